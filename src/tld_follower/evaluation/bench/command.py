# SPDX-License-Identifier: BSD-3-Clause
"""`bench`: measure what tracker, stereo node, simulator and the whole graph cost."""

import argparse
import json
import signal
import sys
import tempfile
from pathlib import Path

import rospy

from tld_follower.evaluation import experiment, graph
from tld_follower.evaluation.bench import flight, simulator, stereo, table, tracker


def _tell(line):
    print(f"bench: {line}", file=sys.stderr, flush=True)


def _measure_lockstep(settings, logs):
    """Fly `experiment straight` without report; returns the object for the JSON."""
    _tell("lockstep: straight")
    chosen = experiment.parse_arguments(["straight", "--tracker", settings.tracker])
    run = experiment.fly(chosen, 0, "stereo", logs)
    return {
        "scenario": chosen.scenario,
        "resolution": chosen.resolution,
        "real_time_factor": run["real_time_factor"],
    }


# Part -> what measures it, given the settings and the folder of the logs.
PARTS = {
    "tracker": lambda settings, _: tracker.measure(settings.tracker, settings.frames, _tell),
    "stereo": lambda settings, logs: stereo.measure(settings.frames, logs, _tell),
    "simulator": lambda _, logs: simulator.measure(_tell),
    "graph": lambda settings, logs: flight.measure(settings.tracker, settings.frames, logs, _tell),
    "lockstep": _measure_lockstep,
}


def _count(text):
    value = int(text)
    if value < 2:
        raise argparse.ArgumentTypeError(f"{text} is not 2 or more")
    return value


def parse_arguments(argv):
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="bench", description=__doc__)
    parser.add_argument("--json", type=Path, metavar="F", help="write the figures")
    parser.add_argument(
        "--part", nargs="+", choices=PARTS, default=list(PARTS), help="default: all, one after another"
    )
    parser.add_argument("--tracker", choices=("tld", "tld_sift"), default="tld")
    parser.add_argument(
        "--frames",
        type=_count,
        default=300,
        metavar="N",
        help="frames of each film, pairs for each stereo node, frames of the flight (300)",
    )
    return parser.parse_args(argv)


def measure(settings, logs):
    """Measure the chosen parts in turn; returns part -> object for the JSON, None where one failed."""
    results = {}
    for part in dict.fromkeys(settings.part):
        try:
            results[part] = PARTS[part](settings, logs)
        except (graph.GraphError, rospy.ROSException) as error:
            _tell(f"{part} failed: {error}")
            results[part] = None
    return results


def main(argv=None):
    """Run the command; returns the exit code."""
    settings = parse_arguments(argv)
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)  # however it is ended, its nodes end with it
    logs = Path(tempfile.mkdtemp(prefix="tld_follower-bench-"))
    try:
        if settings.json:
            settings.json.resolve().parent.mkdir(parents=True, exist_ok=True)
            settings.json.open("a").close()  # before anything is measured in vain
        with graph.private_master(logs):
            rospy.init_node("bench", disable_signals=True)
            results = measure(settings, logs)
            rospy.signal_shutdown("done")
        print(table.text(results))
        if settings.json:
            settings.json.write_text(json.dumps(results, indent=1) + "\n")
            print(f"figures: {settings.json}")
    except (graph.GraphError, OSError) as error:
        _tell(str(error))
        return 1
    except KeyboardInterrupt:
        return 130
    if None in results.values():
        _tell(f"logs are in {logs}")
        return 1
    return 0
