# SPDX-License-Identifier: BSD-3-Clause
"""What the command does around its flights, which are made up here."""

import json

import numpy as np
import pytest

from tld_follower.evaluation import experiment, flight_report, plots
from tld_follower.evaluation.graph import GraphError
from tld_follower.evaluation.metrics import flight_figures, summary
from tld_follower.evaluation.scenarios import SCENARIOS


def made_run(scenario, seed, gap=0.1):
    """Make up a flight along x, `gap` m too far off while the target moves and 0.04 m too near after that."""
    plan = SCENARIOS[scenario](seed)
    t = np.arange(plan.box_at - plan.start, plan.end - plan.start, 1 / 30)
    n, moves = len(t), (t >= 0) & (t < plan.drive_s)
    distance = np.where(moves, 1.0 + gap, np.where(t < 0, 1.0, 0.96))
    x, still = np.cumsum(moves) / 30, np.zeros(n)
    velocity = np.column_stack([np.where(moves, 1.0, 0.0), still, still]).tolist()
    trace = {
        "t": t.tolist(),
        "distance": distance.tolist(),
        "measured_distance": [None, *distance[1:].tolist()],
        "clearance": [0.5] * n,
        "collisions": [0] * n,
        "in_view": [True] * n,
        "box_visible": [True] * n,
        "overlap": [0.8] * n,
        "drone_position": np.column_stack([x - 1.5, still, still]).tolist(),
        "drone_attitude": np.zeros((n, 3)).tolist(),
        "drone_velocity": velocity,
        "target_position": np.column_stack([x, still, still]).tolist(),
        "target_velocity": velocity,
        "command": np.zeros((n, 4)).tolist(),
    }
    figures = flight_figures(trace, plan.drive_s, plan.figures)
    return {"seed": seed, **figures, "real_time_factor": 0.7, "trace": trace}


def made_result(scenario, distance, runs):
    names = ("control", "max_speed", "tracker", "use_depth", "use_right_camera", "resolution", "world")
    settings = {"scenario": scenario, "distance": distance, "image_noise": 1.0, **dict.fromkeys(names, "x")}
    return {**settings, "runs": runs, "summary": summary(runs)}


@pytest.fixture
def flights(monkeypatch):
    """Flights that are made up; seed 1 fails."""

    def fly(settings, seed, *_):
        if seed == 1:
            raise GraphError("a node has died")
        return made_run(settings.scenario, seed)

    monkeypatch.setattr(experiment, "fly", fly)


def test_a_run_that_fails_is_reported_and_costs_no_other(flights, tmp_path, capsys):
    path = tmp_path / "f.json"
    settings = experiment.parse_arguments(["straight", "--seeds", "3", "--json", str(path)])
    results = []
    experiment.fly_all(settings, tmp_path, results)
    written = json.loads(path.read_text())
    assert [run["seed"] for run in written["runs"]] == [0, 1, 2]
    assert written["runs"][1] == {"seed": 1, "error": "a node has died"}
    assert (written["summary"]["runs"], written["summary"]["failed"]) == (3, 1)
    assert experiment.show(settings, results, {}) == 1
    shown = capsys.readouterr().out
    assert "seed 1 failed: a node has died" in shown
    assert "worst" in shown


def test_what_was_flown_is_written_when_it_is_interrupted(flights, tmp_path, monkeypatch):
    def fly(settings, seed, *_):
        if seed == 2:
            raise KeyboardInterrupt
        return made_run(settings.scenario, seed)

    monkeypatch.setattr(experiment, "fly", fly)
    path = tmp_path / "f.json"
    settings = experiment.parse_arguments(["approach", "--seeds", "4", "--json", str(path)])
    with pytest.raises(KeyboardInterrupt):
        experiment.fly_all(settings, tmp_path, [])
    assert [run["seed"] for run in json.loads(path.read_text())["runs"]] == [0, 1]


def test_two_ways_to_measure_the_distance_give_two_objects(flights, tmp_path):
    path = tmp_path / "f.json"
    settings = experiment.parse_arguments(["straight", "--distance", "box", "stereo", "--json", str(path)])
    experiment.fly_all(settings, tmp_path, [])
    assert [result["distance"] for result in json.loads(path.read_text())] == ["box", "stereo"]


def test_the_page_shows_what_the_thesis_says_beside_what_was_measured(tmp_path):
    results = [
        made_result("straight", "box", [made_run("straight", 0, 0.5), made_run("straight", 1, 0.5)]),
        made_result("straight", "stereo", [made_run("straight", 0)]),
    ]
    flight_report.write(results, tmp_path, {"stereo": "film.webm"})
    page = (tmp_path / "report.html").read_text()
    assert "steady error 0.50 m" in page
    assert "4.0 cm" in page
    assert "1.00 m/s, Husky 1.00 m/s" in page
    for figure in ("4.3", "4.5", "4.6"):
        assert f"(thesis figure {figure})" in page
    assert page.count("data:image/png;base64,") == 6
    assert '<video controls src="film.webm">' in page
    assert "http" not in page


@pytest.mark.parametrize(("scenario", "seed"), [("obstacle", 1), ("obstacle", 4), ("occlusion", 2)])
def test_flights_with_obstacles_are_drawn_from_above(tmp_path, scenario, seed):
    plots.plot_path(made_run(scenario, seed), SCENARIOS[scenario](seed), scenario, tmp_path / "p.png")
    assert (tmp_path / "p.png").stat().st_size > 5000


def test_columns_without_a_figure_are_left_out_of_the_table():
    table = flight_report.rows(made_result("approach", "stereo", [made_run("approach", 0)]))
    assert len(table) == 2
    assert "clearance" in table[0]
    assert not {"peak gap", "settled", "longest"} & set(table[0])


def test_the_forward_velocity_is_that_along_the_heading():
    trace = {
        "drone_attitude": [[0.0, 0.0, 0.0], [0.0, 0.0, np.pi / 2]],
        "drone_velocity": [[1.0, 5.0, 0.0], [5.0, -2.0, 0.0]],
        "target_velocity": [[0.5, 0.0, 1.0], [0.0, 3.0, 1.0]],
    }
    drone, target = plots.forward_velocities(trace)
    assert drone == pytest.approx([1.0, -2.0])
    assert target == pytest.approx([0.5, 3.0])
