# SPDX-License-Identifier: BSD-3-Clause
"""The arithmetic of bench, its film, and what it prints."""

import io
import os
import subprocess
import time

import numpy as np
import pytest
import rospy
from sensor_msgs.msg import PointCloud2

from tld_follower.evaluation.bench import command, flight, stereo, table, tracker
from tld_follower.evaluation.bench.cpu import Stopwatch, cpu_seconds
from tld_follower.evaluation.graph import GraphError


def test_cpu_time_of_this_process_is_its_own():
    before = time.process_time()
    found = cpu_seconds(os.getpid())
    assert before <= found <= time.process_time()


def test_a_sleeping_process_costs_nothing_and_a_dead_one_is_an_error():
    child = subprocess.Popen(["sleep", "60"])
    time.sleep(0.1)
    stopwatch = Stopwatch({"child": child.pid})
    spent = sum(range(10**6))  # time that is not the child's
    assert spent
    assert stopwatch.ms_per(2) == {"child": 0.0}
    child.kill()
    child.wait()
    with pytest.raises(GraphError, match="ended"):
        stopwatch.ms_per(1)


def test_cpu_time_is_shared_out_to_the_frames():
    stopwatch = Stopwatch({"me": os.getpid()})
    before = time.process_time()
    while time.process_time() < before + 0.05:
        pass
    assert 5.0 <= stopwatch.ms_per(10)["me"] < 10.0


def test_a_film_moves_its_target_inside_the_image():
    for size in tracker.RESOLUTIONS:
        film = tracker.Film(size, 128)
        boxes = [film.box(index) for index in range(0, 300, 5)]
        assert all(min(box.x, box.y) > 0 and box.right < size[0] and box.bottom < size[1] for box in boxes)
        assert max(box.width for box in boxes) > 1.2 * min(box.width for box in boxes)
        frames = [film.frame(0), film.frame(1)]
        assert frames[0].shape == size[::-1]
        assert 20 < frames[0].std() < 80
        assert (frames[0] != frames[1]).mean() > 0.5


def test_films_are_equal_from_run_to_run():
    first, second = (tracker.Film((320, 240), 32).frame(7) for _ in range(2))
    assert np.array_equal(first, second)


def test_the_target_of_a_film_is_tracked_and_timed():
    cpu_ms, tracked = tracker.measure_one((320, 240), 64, "tld", 10)
    assert cpu_ms > 0.1
    assert tracked == 1.0


def test_figures_of_a_flight_that_keeps_up_but_loses_a_frame():
    moments = [10 + i / 30 for i in range(5)]
    frames = [(t, 500 + t + 0.015) for t in moments]
    begun = {t: 500 + t for t in moments}
    delays = (0.03, 0.02, None, 0.04, 0.1)
    answers = {t: 500 + t + delay for t, delay in zip(moments, delays, strict=True) if delay}
    found = flight.figures(frames, answers, begun)
    assert found["real_time_factor"] == pytest.approx(1.0)
    assert found["skipped_frames"] == 1
    assert found["latency_ms"]["p50"] == pytest.approx(35.0)
    assert found["latency_ms"]["p99"] == pytest.approx(100 - 0.03 * 60)


def test_figures_of_a_slow_flight_without_answers():
    found = flight.figures([(1.0, 7.0), (2.0, 9.0)], {}, {1.0: 7.0, 2.0: 9.0})
    assert found == {"real_time_factor": 0.5, "skipped_frames": 2, "latency_ms": {"p50": None, "p99": None}}


def test_the_stamp_of_a_serialised_message():
    message = PointCloud2()
    message.header.stamp = rospy.Time(12, 345)
    message.header.seq = 7
    buffer = io.BytesIO()
    message.serialize(buffer)
    assert stereo._stamp(buffer.getvalue()) == 12 * 10**9 + 345


def test_an_executable_that_is_not_installed():
    assert stereo._executable("tld_follower", "nothing_of_that_name") is None
    assert stereo._executable("no_package_of_that_name", "node") is None


def test_every_part_has_its_table_and_a_failed_one_says_so():
    results = {
        "tracker": [{"tracker": "tld", "resolution": "320x240", "target_px": 32, "cpu_ms": 3.14}],
        "stereo": {"bm": {"ours_cpu_ms": 10.0, "peer_cpu_ms": None, "ratio": None}},
        "simulator": {"pair_cpu_ms": {"320x240": 5.0, "640x480": 13.0}, "step_us": 11.0},
        "graph": {
            "resolution": "640x480",
            "rate_hz": 30.0,
            "frames": 2,
            **flight.figures([(1.0, 7.0), (2.0, 9.0)], {}, {}),
            "cpu_ms_per_frame": {"/NODE": 5.0},
        },
        "lockstep": None,
    }
    assert set(results) == set(command.PARTS)
    text = table.text(results)
    for shown in ("3.1 ms", "10.0 ms", "11.0 us", "/NODE", "0.500", "not measured"):
        assert shown in text
    assert max(map(len, text.splitlines())) < 80


def test_a_part_that_fails_leaves_the_others(monkeypatch):
    def fail(settings, logs):
        raise GraphError("no graph")

    monkeypatch.setitem(command.PARTS, "graph", fail)
    monkeypatch.setitem(command.PARTS, "tracker", lambda settings, logs: [settings.frames])
    settings = command.parse_arguments(["--part", "graph", "tracker", "--frames", "7"])
    assert command.measure(settings, None) == {"graph": None, "tracker": [7]}


@pytest.mark.parametrize("arguments", [["--part", "engine"], ["--frames", "1"], ["--frames", "many"]])
def test_wrong_arguments_are_refused(arguments):
    with pytest.raises(SystemExit) as ended:
        command.parse_arguments(arguments)
    assert ended.value.code == 2
