# SPDX-License-Identifier: BSD-3-Clause
"""The command `evaluate`: run trackers on annotated sequences and score them."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from tld_follower.box import Box
from tld_follower.evaluation import report, scoring, sequences
from tld_follower.evaluation.thesis import is_fastboard
from tld_follower.tld.parameters import TRACKERS, Parameters
from tld_follower.tld.tracker import Tracker, warm_up

PART_FRAMES = 1000


@dataclasses.dataclass(frozen=True)
class Run:
    """What one tracker did on one sequence.

    Attributes
    ----------
    boxes : its box in each frame, None while lost; the given box in the first.
    cpu_ms : CPU time of each update() [ms].
    templates : size of the object model at the end.
    """

    sequence: sequences.Sequence
    tracker: str
    boxes: list[Box | None]
    cpu_ms: np.ndarray
    templates: int

    def scores(self) -> dict[str, Any]:
        """Return the scores under the names of the JSON file."""
        times = self.cpu_ms if len(self.cpu_ms) else np.zeros(1)
        return {
            "sequence": self.sequence.name,
            "tracker": self.tracker,
            **scoring.score(self.sequence.truth, self.boxes),
            "cpu_ms_mean": float(times.mean()),
            "cpu_ms_p95": float(np.percentile(times, 95)),
            "cpu_ms_first_1000": float(times[:PART_FRAMES].mean()),
            "cpu_ms_last_1000": float(times[-PART_FRAMES:].mean()),
            "templates": self.templates,
        }


def run(sequence: sequences.Sequence, parameters: Parameters, seed: int) -> Run:
    """Run a tracker over a sequence from its first true box."""
    tracker = Tracker(parameters, seed)
    boxes: list[Box | None] = []
    times = []
    for image in sequence.frames():
        if not tracker.initialised:
            boxes.append(sequence.truth[0])
            tracker.init(image, sequence.truth[0])
            continue
        start = time.process_time()
        result = tracker.update(image)
        times.append(1e3 * (time.process_time() - start))
        boxes.append(result.box)
    return Run(sequence, parameters.tracker, boxes, np.array(times), tracker.templates)


def run_all(chosen: list[sequences.Sequence], trackers: list[Parameters], seed: int) -> list[Run]:
    """Run every tracker over every sequence.

    Raises
    ------
    SequenceError
        For a sequence that a tracker cannot be run on.
    """
    runs = []
    for sequence in chosen:
        for parameters in trackers:
            _tell(f"evaluate: {sequence.name}, {parameters.tracker}, {len(sequence.truth)} frames")
            try:
                runs.append(run(sequence, parameters, seed))
            except ValueError as error:
                raise sequences.SequenceError(f"{sequence.name}: {error}") from error
    return runs


def film_fastboard(arguments: argparse.Namespace) -> list[sequences.Sequence]:
    """Film the scenario fastboard for the report."""
    # Only here the ROS graph is needed.
    from tld_follower.evaluation.fastboard import fastboard
    from tld_follower.evaluation.shooting import shoot

    _tell(f"evaluate: filming fastboard, {arguments.fastboard} films")
    folders = shoot(fastboard, range(arguments.fastboard), arguments.report / "fastboard")
    return [sequences.load(folder) for folder in folders]


def _wants_films(arguments: argparse.Namespace, selected: list[sequences.Sequence]) -> bool:
    given = any(is_fastboard(sequence.name) for sequence in selected)
    both = set(arguments.tracker) == set(TRACKERS)
    return both and arguments.fastboard > 0 and not arguments.clips and not given


def parse_settings(settings: list[str]) -> dict[str, Any]:
    """Turn NAME=VALUE strings into parameters, each of the type of its default.

    Raises
    ------
    ValueError
        For a string of another form, an unknown name or a value of another type.
    """
    kinds = {field.name: type(field.default) for field in dataclasses.fields(Parameters)}
    values: dict[str, Any] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
            raise ValueError(f"--set wants NAME=VALUE, got {setting!r}")
        if name == "tracker":
            raise ValueError("--set tracker=...: use --tracker")
        if name not in kinds:
            raise ValueError(f"unknown tracker parameter: {name}")
        try:
            values[name] = _parse_bool(text) if kinds[name] is bool else kinds[name](text)
        except ValueError as error:
            raise ValueError(f"--set {name} wants {kinds[name].__name__}, got {text!r}") from error
    return values


def _parse_bool(text: str) -> bool:
    if text.lower() not in ("true", "false"):
        raise ValueError(text)
    return text.lower() == "true"


def _natural(text: str) -> int:
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"{text} is not 0 or more")
    return value


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="evaluate", description="Score trackers on annotated sequences.")
    parser.add_argument(
        "folders", nargs="+", type=Path, metavar="DIR", help="sequence folder; plain files are passed over"
    )
    parser.add_argument("--tracker", nargs="+", choices=TRACKERS, default=["tld"], help="default: tld")
    parser.add_argument("--clips", type=Path, metavar="CSV", help="clips to run instead of whole sequences")
    parser.add_argument(
        "--set", action="append", default=[], metavar="NAME=VALUE", dest="settings", help="change a parameter"
    )
    parser.add_argument("--seed", type=_natural, default=0, help="seed of the tracker (0)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the scores")
    parser.add_argument("--report", type=Path, metavar="DIR", help="write a page of tables and pictures")
    parser.add_argument(
        "--fastboard",
        type=_natural,
        default=10,
        metavar="N",
        help="films of fastboard to make for a report of both trackers, if none is given; 0: none (10)",
    )
    return parser


def _tell(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def main(argv: list[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    arguments = _parser().parse_args(argv)
    try:
        changes = parse_settings(arguments.settings)
        chosen = [Parameters.from_dict({**changes, "tracker": name}) for name in arguments.tracker]
        folders = [path for path in arguments.folders if not path.is_file()]
        for path in sorted(set(arguments.folders) - set(folders)):
            _tell(f"evaluate: {path} is not a folder, passed over")
        if not folders:
            raise sequences.SequenceError("no sequence folder given")
        selected = [sequences.load(folder) for folder in folders]
        if arguments.clips:
            selected = sequences.load_clips(arguments.clips, selected)
        _tell("evaluate: compiling")
        warm_up()
        runs = run_all(selected, chosen, arguments.seed)
        results = [one.scores() for one in runs]
        films, missing = [], ""
        if arguments.json:
            arguments.json.write_text(json.dumps(results, indent=2) + "\n")
        if arguments.report:
            if _wants_films(arguments, selected):
                try:
                    films = run_all(film_fastboard(arguments), chosen, arguments.seed)
                except (ImportError, sequences.SequenceError) as error:
                    missing = f"not measured: {error}"
                    _tell(f"evaluate: fastboard is {missing}")
            report.write(arguments.report, runs, results, films, missing)
    except (sequences.SequenceError, ValueError, OSError) as error:
        _tell(f"evaluate: {error}")
        return 1
    print(report.text_table(results))
    return 0


if __name__ == "__main__":
    sys.exit(main())
