# SPDX-License-Identifier: BSD-3-Clause
import cv2
import pytest

from tld_follower.evaluation import thesis


def result(sequence, tracker, tp, fp=0, fn=0, tn=0, failures=0):
    counts = {"tp": tp, "fp": fp, "fn": fn, "tn": tn}
    return {
        "sequence": sequence,
        "tracker": tracker,
        "frames": tp + fn + tn,
        "absent": tn,
        "overlap": {"0.25": counts},
        "failures": failures,
        "reentries": 3,
        "reentries_found": 1,
    }


def rows(table):
    return {row[0]: dict(zip(table[0], row, strict=True)) for row in table[1:]}


def test_counts_stand_beside_the_published_ones():
    results = [
        result("jumping", "tld", 300, fn=13),
        result("jumping", "tld_sift", 313),
        result("car", "tld", 860),
        result("fastboard-0", "tld", 10, fn=120, tn=135),
        result("fastboard-1", "tld", 21, fn=119, tn=125),
    ]
    table = rows(thesis.table_counts(results))
    assert list(table) == ["Jumping", "Car Chase", "Pedestrian-3", "Motocross", "David", "Fastboard"]
    jumping = table["Jumping"]
    assert (jumping["TLD (thesis)"], jumping["TLD"]) == ("313", "300")
    assert (jumping["TLD_SIFT (thesis)"], jumping["TLD_SIFT"]) == ("313", "313")
    assert table["Car Chase"]["TLD_SIFT (thesis)"] == "5979"
    assert table["Car Chase"]["TLD"] == "-"
    fastboard = table["Fastboard"]
    assert (fastboard["Frames"], fastboard["Occlusions"]) == ("265", "130")
    assert (fastboard["TLD (thesis)"], fastboard["TLD"], fastboard["TLD_SIFT"]) == ("11", "15.5", "-")


def test_scores_are_in_percent_and_pool_the_films():
    results = [
        result("fastboard-0", "tld_sift", 10, fp=10, fn=10),
        result("fastboard-1", "tld_sift", 30, fp=0, fn=30),
        result("motocross_first100", "tld", 80, fp=20, fn=0),
    ]
    table = rows(thesis.table_scores(results))
    fastboard = table["Fastboard"]
    assert [fastboard[f"TLD_SIFT {s}"] for s in "PRF"] == ["80.00", "50.00", "61.54"]
    assert [fastboard[f"TLD {s} (thesis)"] for s in "PRF"] == ["61.11", "7.85", "18"]
    assert [table["Motocross"][f"TLD {s}"] for s in "PRF"] == ["80.00", "100.00", "88.89"]


@pytest.mark.parametrize(
    ("name", "films"), [("fastboard", True), ("fastboard-3", True), ("skateboard", False)]
)
def test_films_go_by_their_name(name, films):
    assert thesis.is_fastboard(name) is films


def test_the_figure_shows_each_trackers_mean(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(thesis.plt.Axes, "annotate", lambda _, text, *args, **kwargs: drawn.append(text))
    results = [result(f"fastboard-{i}", "tld", 1, failures=i % 3) for i in range(4)]
    results += [result(f"fastboard-{i}", "tld_sift", 1, failures=i % 2) for i in range(4)]
    thesis.plot_failures(results, tmp_path / "failures.png")
    assert drawn == ["0.8", "0.5", "2.0", "2.0"]
    assert cv2.imread(str(tmp_path / "failures.png")).shape[1] > 600
