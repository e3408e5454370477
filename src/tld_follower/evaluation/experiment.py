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

from tld_follower.evaluation import flight_report, graph, plots
from tld_follower.evaluation.film import Film
from tld_follower.evaluation.flight import Flight
from tld_follower.evaluation.metrics import first_difference, flight_figures, summary
from tld_follower.evaluation.scenarios import SCENARIOS
from tld_follower.evaluation.stage import simulation_arguments
from tld_follower.evaluation.worlds import WorldError, write_world
from tld_follower.following.parameters import CONTROLS, DISTANCES, Parameters

FRAME_RATE = 30.0


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
    parser.add_argument(
        "--distance",
        nargs="+",
        choices=DISTANCES,
        default=["stereo"],
        help="two are flown one after the other",
    )
    parser.add_argument("--control", choices=CONTROLS, default=Parameters.control)
    parser.add_argument(
        "--max-speed", type=_number(float, 0.01, "a positive number"), default=1.5, metavar="M/S"
    )
    parser.add_argument("--tracker", choices=("tld", "tld_sift"), default="tld")
    parser.add_argument(
        "--use-depth",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="the tracker takes the cloud as well, or images alone",
    )
    parser.add_argument(
        "--use-right-camera",
        action="store_true",
        help="the tracker takes the right image while it shows more of the target",
    )
    parser.add_argument("--resolution", type=_resolution, default="640x480", metavar="WxH")
    parser.add_argument(
        "--world", type=Path, metavar="FILE", help="SDF world in which the scenario is set (default: its own)"
    )
    parser.add_argument(
        "--image-noise", type=_number(float, 0, "0 or more"), default=1.0, metavar="SIGMA", help="grey levels"
    )
    parser.add_argument(
        "--seeds", type=_number(int, 1, "a positive number"), default=1, metavar="N", help="how many runs"
    )
    parser.add_argument("--first-seed", type=_number(int, 0, "a seed: 0 or more"), default=0, metavar="K")
    parser.add_argument(
        "--twice", action="store_true", help="fly every seed twice; it fails unless both traces are identical"
    )
    parser.add_argument("--json", type=Path, metavar="F", help="write settings, figures and traces")
    parser.add_argument(
        "--report", type=Path, metavar="DIR", help="write a page with plots, and a video of the first run"
    )
    parser.add_argument(
        "--film",
        type=Path,
        metavar="DIR",
        help="save each flight as a sequence for evaluate: DIR/SCENARIO-SEED",
    )
    return parser.parse_args(argv)


def launch_arguments(settings, plan, seed, distance, folder):
    """Arguments of follow.launch for one run; writes its world into `folder`."""
    return {
        **simulation_arguments(plan, seed, settings.resolution, settings.image_noise, folder, settings.world),
        "vehicle": plan.vehicle,
        "distance": distance,
        "control": settings.control,
        "max_speed": settings.max_speed,
        "tracker": settings.tracker,
        "use_depth": str(settings.use_depth).lower(),
        "use_right_camera": str(settings.use_right_camera).lower(),
        "commands": "/pointsdepthA/cmd_vel" if plan.scripted else "/cmd_vel",
    }


def fly(settings, seed, distance, logs, video=None, film=None):
    """Fly one seed on a fresh graph; return the run's object for the JSON.

    `video` is a file, `film` a folder for sequences; None for none.
    """
    plan = SCENARIOS[settings.scenario](seed)
    with ExitStack() as stack:
        watchers = []
        if video:
            size = tuple(map(int, settings.resolution.split("x")))
            watchers.append(plots.Video(video, size, FRAME_RATE))
        if film:
            watchers.append(Film(film / f"{plan.scenario}-{seed}"))
        for watcher in watchers:
            stack.callback(watcher.close)
        flight = Flight(plan, [watcher.add for watcher in watchers])
        stack.callback(flight.close)
        log = logs / f"{plan.scenario}-{distance}-{seed}.log"
        arguments = launch_arguments(settings, plan, seed, distance, logs)
        alive = stack.enter_context(graph.launched("follow.launch", arguments, log))
        more = {graph.DEPTH_EDGE: settings.use_depth, graph.RIGHT_EDGE: settings.use_right_camera}
        flight.wait_until_connected(alive, [edge for edge, used in more.items() if used])
        trace, real_time_factor = flight.fly(alive)
    figures = flight_figures(trace, plan.drive_s, plan.figures)
    return {"seed": seed, **figures, "real_time_factor": real_time_factor, "trace": trace}


def prepare(settings, logs):
    """Make the folders of report, films and JSON, and try the user's world.

    Raises
    ------
    OSError, WorldError
        Before anything has flown in vain.
    """
    for folder in filter(None, (settings.report, settings.film)):
        folder.mkdir(parents=True, exist_ok=True)
    if settings.json:
        settings.json.resolve().parent.mkdir(parents=True, exist_ok=True)
        settings.json.open("a").close()
    if settings.world:
        write_world(SCENARIOS[settings.scenario](settings.first_seed), settings.world, logs / "first.world")


def fly_again(settings, run, distance, logs):
    """Fly the seed of a run once more; GraphError unless the trace is the same."""
    again = fly(settings, run["seed"], distance, logs)
    difference = first_difference(run["trace"], again["trace"])
    if difference:
        raise graph.GraphError(f"not repeatable: two flights part at {difference}")


def fly_all(settings, logs, results):
    """Fly every seed for every way to measure the distance; a run that fails costs no other.

    Fills `results`, a list of objects for the JSON, and writes them after each run; returns a dict of the
    videos, see `flight_report.write`.
    """
    videos = {}
    for distance in settings.distance:
        runs = []
        results.append(
            {
                "scenario": settings.scenario,
                "distance": distance,
                "control": settings.control,
                "max_speed": settings.max_speed,
                "tracker": settings.tracker,
                "use_depth": settings.use_depth,
                "use_right_camera": settings.use_right_camera,
                "resolution": settings.resolution,
                "world": settings.world.name if settings.world else SCENARIOS[settings.scenario](0).world,
                "image_noise": settings.image_noise,
                "runs": runs,
            }
        )
        for seed in range(settings.first_seed, settings.first_seed + settings.seeds):
            began = time.monotonic()
            _tell(f"{settings.scenario}, distance from {distance}, seed {seed} ...")
            video = f"left_camera_{distance}.webm" if settings.report and distance not in videos else None
            try:
                path = settings.report / video if video else None
                run = fly(settings, seed, distance, logs, path, settings.film)
                if settings.twice:
                    fly_again(settings, run, distance, logs)
                runs.append(run)
                if video:
                    videos[distance] = video
            except (graph.GraphError, rospy.ROSException) as error:
                runs.append({"seed": seed, "error": str(error)})
                _tell(f"seed {seed} failed: {error}\nexperiment: logs are in {logs}")
            else:
                _tell(f"seed {seed} took {time.monotonic() - began:.0f} s")
            results[-1]["summary"] = summary(runs)
            if settings.json:
                written = results[0] if len(settings.distance) == 1 else results
                settings.json.write_text(json.dumps(written, separators=(",", ":")) + "\n")
    return videos


def _tell(text):
    print(f"experiment: {text}", file=sys.stderr, flush=True)


def main(argv=None):
    """Run the command; returns the exit code."""
    settings = parse_arguments(argv)
    if settings.world and not settings.world.is_file():
        _tell(f"no world file {settings.world}")
        return 2
    logs = Path(tempfile.mkdtemp(prefix="tld_follower-experiment-"))
    try:
        prepare(settings, logs)
    except (OSError, WorldError) as error:
        _tell(error)
        return 2
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)  # however it is ended, the graph ends with it
    results = []
    try:
        with graph.private_master(logs):
            rospy.init_node("experiment", disable_signals=True)
            videos = fly_all(settings, logs, results)
            rospy.signal_shutdown("done")
        return show(settings, results, videos)
    except (graph.GraphError, rospy.ROSException, OSError) as error:
        _tell(f"{error}\nexperiment: logs are in {logs}")
        return 1
    except KeyboardInterrupt:
        return 130


def show(settings, results, videos):
    """Print the tables, write the report, and say what lies where; returns the exit code."""
    for result in results:
        if len(results) > 1:
            print(f"distance from {result['distance']}:")
        print(flight_report.text_table(result))
    if settings.json:
        print(f"figures and traces: {settings.json}")
    if settings.report and all(result["summary"]["runs"] > result["summary"]["failed"] for result in results):
        flight_report.write(results, settings.report, videos)
        names = ("report.html", *videos.values())
        print("page with plots, and video:", *(settings.report / name for name in names), sep="\n  ")
    if settings.film:
        print(f"films: {settings.film}")
    return 1 if any(result["summary"]["failed"] for result in results) else 0
