# SPDX-License-Identifier: BSD-3-Clause
"""How the experiment command goes through its seeds; no graph is started."""

import pytest

from tld_follower.evaluation import experiment


@pytest.fixture
def flights(monkeypatch):
    """What `fly` was asked for; no two flights of seed 1 are alike."""
    asked = []

    def fly(settings, seed, distance, logs, video=None, film=None):
        asked.append((seed, video, film))
        where = 1.0 if seed != 1 else float(len(asked))
        return {"seed": seed, "trace": {"t": [0.0], "distance": [where]}}

    monkeypatch.setattr(experiment, "fly", fly)
    monkeypatch.setattr(experiment, "summary", lambda runs: {"runs": len(runs)})
    return asked


def fly_all(*arguments):
    results = []
    experiment.fly_all(experiment.parse_arguments(["straight", *map(str, arguments)]), None, results)
    return results[0]["runs"]


def test_each_seed_is_flown_once_and_filmed(flights, tmp_path):
    runs = fly_all("--seeds", 2, "--film", tmp_path)
    assert [run["seed"] for run in runs] == [0, 1]
    assert flights == [(0, None, tmp_path), (1, None, tmp_path)]


def test_second_flights_are_neither_shown_nor_filmed_and_fail_the_run_that_they_differ_from(
    flights, tmp_path
):
    first, second = fly_all("--seeds", 2, "--twice", "--film", tmp_path, "--report", tmp_path)
    assert [(seed, bool(video), bool(film)) for seed, video, film in flights] == [
        (0, True, True),
        (0, False, False),
        (1, False, True),
        (1, False, False),
    ]
    assert "trace" in first
    assert second["error"] == "not repeatable: two flights part at t = 0.000 s, in distance"
