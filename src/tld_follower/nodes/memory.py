# SPDX-License-Identifier: BSD-3-Clause
"""Keeps the memory that large messages come in."""

import ctypes

_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # mallopt(3)


def keep_memory():
    """Have this process use the memory of messages that it is done with for the next ones.

    glibc hands blocks of their size back to the kernel and asks for fresh pages at every message, which the
    kernel must zero: more than half of the CPU time that it takes rospy to receive a cloud of 10 MB.
    """
    libc = ctypes.CDLL(None)
    libc.mallopt(_M_MMAP_THRESHOLD, 32 << 20)  # the largest that is allowed
    libc.mallopt(_M_TRIM_THRESHOLD, 128 << 20)
