# SPDX-License-Identifier: BSD-3-Clause
import dataclasses
import math
from pathlib import Path

import pytest
import yaml

from tld_follower.tld.parameters import Parameters

CONFIG = Path(__file__).resolve().parents[3] / "config" / "tracker.yaml"


def test_the_config_file_has_every_parameter_with_its_default():
    documented = yaml.safe_load(CONFIG.read_text())
    defaults = dataclasses.asdict(Parameters())
    assert sorted(documented) == sorted(defaults)
    assert documented == defaults
    assert {name: type(v) for name, v in documented.items()} == {n: type(v) for n, v in defaults.items()}


def test_named_values_replace_the_defaults():
    assert Parameters.from_dict({}) == Parameters()
    changed = Parameters.from_dict({"tracker": "tld_sift", "ferns": 7, "shift": 0.2, "learning": False})
    assert (changed.tracker, changed.ferns, changed.shift, changed.learning) == ("tld_sift", 7, 0.2, False)
    assert changed.scales == Parameters().scales


def test_whole_numbers_are_fine_for_lengths():
    assert Parameters(min_side=12).min_side == 12.0
    assert type(Parameters(min_side=12).min_side) is float


@pytest.mark.parametrize("name", ["nonsense", "Ferns", "", "nn-threshold"])
def test_unknown_names_are_refused(name):
    with pytest.raises(ValueError, match=f"unknown tracker parameter.*{name}"):
        Parameters.from_dict({name: 1})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("tracker", "kcf"),
        ("tracker", 1),
        ("learning", 1),
        ("learning", "true"),
        ("ferns", 0),
        ("ferns", -1),
        ("ferns", 2.5),
        ("ferns", True),
        ("ferns", None),
        ("comparisons", 40),
        ("nn_threshold", "0.6"),
        ("nn_threshold", -0.1),
        ("nn_threshold", math.nan),
        ("blur", math.inf),
        ("blur", 0.0),
        ("shift", 0.0),
        ("scale_step", 1.0),
        ("min_side", 0.0),
        ("window_side", 0.0),
        ("lk_window", 2),
        ("max_windows", 0),
        ("positive_overlap", 0.01),
    ],
)
def test_wrong_values_are_refused_by_name(name, value):
    with pytest.raises(ValueError, match=name):
        Parameters.from_dict({name: value})
