"""`experiment`: fly a scenario on the whole ROS graph in lockstep, for several seeds, and measure it."""

import argparse
import json
import math
import re
import signal
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import rospy

from tld_follower.evaluation import graph, plots
from tld_follower.evaluation.fastboard import FASTBOARD
from tld_follower.evaluation.film import Film
from tld_follower.evaluation.flight import Flight
from tld_follower.evaluation.metrics import flight_figures
from tld_follower.evaluation.scenarios import OCCLUSION, STRAIGHT
from tld_follower.evaluation.stage import simulation_arguments

SCENARIOS = {scenario.name: scenario for scenario in (STRAIGHT, OCCLUSION, FASTBOARD)}
FRAME_RATE = 30.0
COLUMNS = (
    ("seed", "seed", "{:d}"),
    ("peak_gap_m", "peak gap", "{:.3f} m"),
    ("steady_error_m", "steady error", "{:.3f} m"),
    ("rmse_m", "rmse", "{:.3f} m"),
    ("overshoot_m", "overshoot", "{:.3f} m"),
    ("settle_s", "settled", "{:.2f} s"),
    ("min_clearance_m", "clearance", "{:.2f} m"),
    ("collisions", "collisions", "{:d}"),
    ("tracked_fraction", "tracked", "{:.3f}"),
    ("mean_overlap", "overlap", "{:.2f}"),
    ("wrong_boxes", "wrong boxes", "{:d}"),
    ("boxes_while_hidden", "while hidden", "{:d}"),
    ("reentries", "re-entries", "{:d}"),
    ("reentries_found", "found", "{:d}"),
    ("failures", "failures", "{:d}"),
    ("losses", "losses", "{:d}"),
    ("real_time_factor", "real time", "{:.2f}x"),
)


def _resolution(text):
    if not re.fullmatch(r"[1-9]\d{1,3}x[1-9]\d{1,3}", text):
        raise argparse.ArgumentTypeError(f"{text!r} is not WIDTHxHEIGHT")
    return text


def _number(convert, least, description):
    def parse(text):
        value = convert(text)
        if not least <= value < math.inf:
            raise argparse.ArgumentTypeError(f"{text} is not {description}")
        return value

    return parse


def parse_arguments(argv):
    """Read the command line."""
    parser = argparse.ArgumentParser(prog="experiment", description=__doc__)
    parser.add_argument("scenario", choices=sorted(SCENARIOS))
    parser.add_argument("--distance", choices=("stereo", "box"), default="stereo")
    parser.add_argument("--control", choices=("thesis",), default="thesis")
    parser.add_argument(
        "--max-speed", type=_number(float, 0.01, "a positive number"), default=1.5, metavar="M/S"
    )
    parser.add_argument("--tracker", choices=("tld", "tld_sift"), default="tld")
    parser.add_argument(
        "--use-depth", action="store_true", help="the tracker takes the cloud as well (default: images alone)"
    )
    parser.add_argument("--resolution", type=_resolution, default="640x480", metavar="WxH")
    parser.add_argument("--world", type=Path, metavar="FILE", help="SDF world (default: the scenario's own)")
    parser.add_argument(
        "--image-noise", type=_number(float, 0, "0 or more"), default=1.0, metavar="SIGMA", help="grey levels"
    )
    parser.add_argument(
        "--seeds", type=_number(int, 1, "a positive number"), default=1, metavar="N", help="how many runs"
    )
    parser.add_argument("--first-seed", type=_number(int, 0, "a seed: 0 or more"), default=0, metavar="K")
    parser.add_argument("--json", type=Path, metavar="F", help="write settings, figures and traces")
    parser.add_argument(
        "--report", type=Path, metavar="DIR", help="write plots, and a video of the first run"
    )
    parser.add_argument(
        "--film",
        type=Path,
        metavar="DIR",
        help="save each flight as a sequence for evaluate: DIR/SCENARIO-SEED",
    )
    return parser.parse_args(argv)


def launch_arguments(settings, scenario, seed):
    """Arguments of follow.launch for one run."""
    return {
        **simulation_arguments(scenario, seed, settings.resolution, settings.image_noise, settings.world),
        "distance": settings.distance,
        "control": settings.control,
        "max_speed": settings.max_speed,
        "tracker": settings.tracker,
        "use_depth": str(settings.use_depth).lower(),
        "commands": "/pointsdepthA/cmd_vel" if scenario.scripted else "/cmd_vel",
    }


def fly(settings, seed, logs, video_path):
    """Fly one seed on a fresh graph; return the run's object for the JSON."""
    scenario = SCENARIOS[settings.scenario]
    with ExitStack() as stack:
        watchers = []
        if video_path:
            size = tuple(map(int, settings.resolution.split("x")))
            watchers.append(plots.Video(video_path, size, FRAME_RATE))
        if settings.film:
            watchers.append(Film(settings.film / f"{scenario.name}-{seed}"))
        for watcher in watchers:
            stack.callback(watcher.close)
        flight = Flight(scenario, seed, [watcher.add for watcher in watchers])
        stack.callback(flight.close)
        log = logs / f"{scenario.name}-{seed}.log"
        arguments = launch_arguments(settings, scenario, seed)
        alive = stack.enter_context(graph.launched("follow.launch", arguments, log))
        flight.wait_until_connected(alive, settings.use_depth)
        trace, real_time_factor = flight.fly(alive)
    figures = flight_figures(trace, None if scenario.scripted else scenario.halt - scenario.start)
    return {"seed": seed, **figures, "real_time_factor": real_time_factor, "trace": trace}


def table(runs):
    """Lay out the runs' figures as text."""
    rows = [[title for _, title, _ in COLUMNS]]
    for run in runs:
        rows.append(["-" if run[key] is None else form.format(run[key]) for key, _, form in COLUMNS])
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows
    )


def write_report(result, directory, drive_s):
    """Write the plots; return their paths."""
    title = (
        f"{result['scenario']}: {result['control']} control, distance from {result['distance']}, "
        f"at most {result['max_speed']} m/s"
    )
    distance, velocity = directory / "distance.png", directory / "velocity.png"
    plots.plot_distance(result["runs"], drive_s, title, distance)
    plots.plot_velocity(result["runs"][0], drive_s, title, velocity)
    return distance, velocity


def prepare_outputs(settings):
    """Make the folders of report, films and JSON; raises OSError before anything has flown in vain."""
    for folder in filter(None, (settings.report, settings.film)):
        folder.mkdir(parents=True, exist_ok=True)
    if settings.json:
        settings.json.resolve().parent.mkdir(parents=True, exist_ok=True)
        settings.json.open("a").close()


def main(argv=None):
    """Run the command; returns the exit code."""
    settings = parse_arguments(argv)
    if settings.world and not settings.world.is_file():
        print(f"experiment: no world file {settings.world}", file=sys.stderr)
        return 2
    scenario = SCENARIOS[settings.scenario]
    try:
        prepare_outputs(settings)
    except OSError as error:
        print(f"experiment: {error}", file=sys.stderr)
        return 2
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)  # however it is ended, the graph ends with it
    result = {
        "scenario": scenario.name,
        "distance": settings.distance,
        "control": settings.control,
        "max_speed": settings.max_speed,
        "tracker": settings.tracker,
        "use_depth": settings.use_depth,
        "resolution": settings.resolution,
        "world": settings.world.name if settings.world else scenario.world,
        "image_noise": settings.image_noise,
        "runs": [],
    }
    logs = Path(tempfile.mkdtemp(prefix="tld_follower-experiment-"))
    video = settings.report / "left_camera.webm" if settings.report else None
    try:
        with graph.private_master(logs):
            rospy.init_node("experiment", disable_signals=True)
            for seed in range(settings.first_seed, settings.first_seed + settings.seeds):
                began = time.monotonic()
                print(f"experiment: {scenario.name}, seed {seed} ...", file=sys.stderr, flush=True)
                result["runs"].append(
                    fly(settings, seed, logs, video if seed == settings.first_seed else None)
                )
                print(
                    f"experiment: seed {seed} took {time.monotonic() - began:.0f} s",
                    file=sys.stderr,
                    flush=True,
                )
            rospy.signal_shutdown("done")
    except (graph.GraphError, rospy.ROSException, OSError) as error:
        print(f"experiment: {error}\nexperiment: logs are in {logs}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130

    print(table(result["runs"]))
    if settings.json:
        settings.json.write_text(json.dumps(result, indent=1) + "\n")
        print(f"figures and traces: {settings.json}")
    if settings.report:
        paths = [*write_report(result, settings.report, scenario.halt - scenario.start), video]
        print("plots and video:", *paths, sep="\n  ")
    if settings.film:
        print(f"films: {settings.film}")
    return 0
