# SPDX-License-Identifier: BSD-3-Clause
from pathlib import Path

import cv2
import numpy as np
import pytest

from tld_follower.box import Box
from tld_follower.evaluation import report
from tld_follower.evaluation.evaluate import Run
from tld_follower.evaluation.sequences import Sequence

HERE, HALF, AWAY = Box(20, 20, 40, 30), Box(40, 20, 40, 30), Box(200, 100, 40, 30)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "img").mkdir()
    for index in range(4):
        cv2.imwrite(str(tmp_path / "img" / f"{index:05d}.png"), np.zeros((150, 300, 3), np.uint8))
    return tmp_path


def run(boxes, truth=None, tracker="tld", folder=Path(), times=(1.0, 2.0, 6.0)):
    truth = tuple(truth or [HERE] * len(boxes))
    return Run(Sequence("s", folder, truth), tracker, boxes, np.array(times), 5)


def test_success_is_the_share_of_visible_frames_above_each_overlap():
    truth = [HERE, HERE, HERE, None]
    curve = report.success(run([HERE, HALF, AWAY, None], truth))
    thresholds = report.SUCCESS_OVERLAPS
    assert curve[np.searchsorted(thresholds, 0.1)] == pytest.approx(2 / 3)
    assert curve[np.searchsorted(thresholds, 0.5)] == pytest.approx(1 / 3)
    assert np.all(np.diff(curve) <= 0)


def test_times_are_of_update_alone():
    scores = run([HERE] * 4).scores()
    assert scores["cpu_ms_mean"] == pytest.approx(3.0)
    assert 2.0 < scores["cpu_ms_p95"] <= 6.0
    assert scores["cpu_ms_first_1000"] == scores["cpu_ms_last_1000"] == pytest.approx(3.0)
    long = run([HERE] * 2001, times=[1.0] * 1000 + [3.0] * 1000).scores()
    assert (long["cpu_ms_first_1000"], long["cpu_ms_last_1000"]) == pytest.approx((1.0, 3.0))
    assert run([HERE], times=()).scores()["cpu_ms_mean"] == 0.0


def test_the_table_has_a_row_a_run_and_means_for_each_tracker():
    runs = [run([HERE, HERE]), run([HERE, AWAY]), run([HERE, HALF], tracker="tld_sift")]
    table = report.rows([one.scores() for one in runs])
    assert [row[:2] for row in table] == [
        *(["s", "tld"], ["s", "tld"], ["s", "tld_sift"]),
        *(["mean", "tld"], ["mean", "tld_sift"]),
    ]
    f25 = report.HEADER.index("F25")
    assert [float(row[f25]) for row in table] == pytest.approx([1.0, 0.5, 1.0, 0.75, 1.0])
    lines = report.text_table([one.scores() for one in runs]).splitlines()
    assert len(lines) == 6
    assert lines[0].split()[:2] == ["sequence", "tracker"]
    assert len({line.index("tld") for line in lines[1:]}) == 1


def test_the_contact_sheet_shows_true_and_found_boxes(folder):
    sheet = report.contact_sheet(run([HERE, HALF, None, None], [HERE, HERE, HERE, None], folder=folder))
    scale = report.TILE_WIDTH / 300
    first = sheet[:120, : report.TILE_WIDTH]
    corner = round(scale * HERE.bottom), round(scale * HERE.right)
    assert tuple(first[corner]) == report.FOUND_COLOR
    last = sheet[-120:, -report.TILE_WIDTH :]
    assert not (last == report.TRUE_COLOR).all(axis=2).any()
    assert not (last == report.FOUND_COLOR).all(axis=2).any()


def test_a_folder_that_cannot_be_made_is_an_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"):
        report.write(tmp_path / "file" / "report", [], [])
