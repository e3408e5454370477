# SPDX-License-Identifier: BSD-3-Clause
"""CPU time of other processes."""

import time
import xmlrpc.client

import rosgraph

from tld_follower.evaluation.graph import GraphError

_CALLER = "/bench"
_CPUCLOCK_SCHED = 2  # Linux, posix-timers.h: all that the scheduler gave to all threads


def cpu_seconds(pid):
    """CPU time of a process so far, of all its threads, in s; OSError if there is no such process."""
    return time.clock_gettime(~pid << 3 | _CPUCLOCK_SCHED)  # what clock_getcpuclockid(3) makes of a pid


def node_pids(names):
    """Process ids of running nodes, name -> pid; GraphError for one that does not answer."""
    pids = {}
    for name in names:
        try:
            uri = rosgraph.Master(_CALLER).lookupNode(name)
            pids[name] = xmlrpc.client.ServerProxy(uri).getPid(_CALLER)[2]
        except (rosgraph.MasterException, OSError, xmlrpc.client.Error) as error:
            raise GraphError(f"{name} does not answer: {error}") from error
    return pids


class Stopwatch:
    """CPU time of some processes from the start on.

    Parameters
    ----------
    pids : dict
        Name -> process id.
    """

    def __init__(self, pids):
        self._pids = pids
        self._start = self._read()

    def _read(self):
        try:
            return {name: cpu_seconds(pid) for name, pid in self._pids.items()}
        except OSError as error:
            raise GraphError("a process that is measured has ended") from error

    def ms_per(self, count):
        """CPU time since the start in ms, divided by `count`: name -> ms."""
        return {name: 1e3 * (now - self._start[name]) / count for name, now in self._read().items()}
