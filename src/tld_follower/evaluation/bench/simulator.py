# SPDX-License-Identifier: BSD-3-Clause
"""What the simulator's pictures and physics cost, as its own benchmark measures them."""

import json
import subprocess

import roslib.packages

from tld_follower.evaluation.graph import GraphError, world_file


def measure(tell):
    """Run `bullet_sim_bench`; returns the object for the JSON, see doc/bench.md.

    Raises
    ------
    GraphError
        If it is not built or fails.
    """
    tell("simulator")
    found = roslib.packages.find_node("tld_follower", "bullet_sim_bench")
    if not found:
        raise GraphError("bullet_sim_bench is not built")
    world = world_file("testing_grounds.world")  # has more than 20 obstacles
    done = subprocess.run([found[0], world], capture_output=True, text=True, check=False)
    if done.returncode:
        raise GraphError(f"bullet_sim_bench failed: {done.stderr.strip()}")
    return json.loads(done.stdout)
