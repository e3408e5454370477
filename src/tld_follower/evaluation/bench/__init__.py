# SPDX-License-Identifier: BSD-3-Clause
"""The command `bench`: what the parts of the system cost, and the whole of it."""
