# SPDX-License-Identifier: BSD-3-Clause
"""The command bench measures every part on running nodes; with few frames its figures say little."""

import json
import subprocess
from pathlib import Path

import pytest

BENCH = Path(__file__).resolve().parents[2] / "scripts" / "bench"


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    path = tmp_path_factory.mktemp("bench") / "bench.json"
    done = subprocess.run(
        [BENCH, "--frames", "6", "--json", path],
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    assert "stereo_cloud" in done.stdout
    return json.loads(path.read_text())


def test_the_tracker_at_every_size(result):
    assert {(entry["resolution"], entry["target_px"]) for entry in result["tracker"]} == {
        (resolution, target) for resolution in ("320x240", "640x480", "1280x720") for target in (32, 64, 128)
    }
    assert all(entry["cpu_ms"] > 0.1 for entry in result["tracker"])


def test_the_stereo_nodes(result):
    for figures in result["stereo"].values():
        assert figures["ours_cpu_ms"] > 1.0
        if figures["peer_cpu_ms"] is None:  # not installed
            assert figures["ratio"] is None
        else:
            assert figures["ratio"] == pytest.approx(figures["ours_cpu_ms"] / figures["peer_cpu_ms"])


def test_the_simulator(result):
    pair = result["simulator"]["pair_cpu_ms"]
    assert 0.5 < pair["320x240"] < pair["640x480"]
    assert result["simulator"]["step_us"] > 0.5


def test_the_whole_graph(result):
    flight = result["graph"]
    assert (flight["resolution"], flight["rate_hz"], flight["frames"]) == ("640x480", 30.0, 6)
    assert flight["real_time_factor"] > 0
    assert 0 <= flight["skipped_frames"] <= 6
    assert 0 <= flight["followed_frames"] <= 6
    latency = flight["latency_ms"]
    assert latency["p50"] is None or 1.0 < latency["p50"] <= latency["p99"]
    assert {"/gazebo", "/NODE", "/pointsdepthA", "/stereo/stereo_image_proc"} < set(
        flight["cpu_ms_per_frame"]
    )
    assert all(cpu_ms > 0 for cpu_ms in flight["cpu_ms_per_frame"].values())


def test_lockstep(result):
    assert result["lockstep"]["scenario"] == "straight"
    assert result["lockstep"]["real_time_factor"] > 0.05
