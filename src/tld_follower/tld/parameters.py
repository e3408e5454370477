# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the tracker. config/tracker.yaml documents the same names for ROS users."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

TRACKERS = ("tld", "tld_sift")
LOWER_BOUNDS = {
    **{"scale_step": 1.0, "shift": 0.0, "min_side": 2.0, "flow_side": 0.0, "window_side": 2.0},
    **{"blur": 0.0, "fusion_weight": 0.0, "max_residual": 0.0, "lk_window": 2, "sift_side": 8.0},
    **{"depth_size": 1.0, "positive_overlap": 0.01},
}
# A fern has a table of 2^comparisons posteriors; the scan makes codes of 16 bits.
MAX_COMPARISONS = 16


@dataclass(frozen=True)
class Parameters:
    """Everything that can be tuned. Lengths are in pixels, similarities and probabilities 0..1."""

    tracker: str = "tld"
    learning: bool = True
    min_side: float = 8.0

    grid_points: int = 10
    lk_window: int = 11
    lk_levels: int = 3
    flow_side: float = 32.0
    flow_patch: int = 10
    max_fb_error: float = 0.25
    motion_margin: float = 0.035

    scale_step: float = 1.2
    shift: float = 0.1
    scales: int = 10
    tracking_scales: int = 4
    window_side: float = 24.0
    max_windows: int = 60000

    variance_ratio: float = 0.5
    ferns: int = 10
    comparisons: int = 13
    blur: float = 3.0
    fern_threshold: float = 0.5
    max_candidates: int = 100

    nn_threshold: float = 0.65
    redetection_margin: float = 0.07
    redetection_reach: float = 1.0
    min_conservative: float = 0.47
    positive_threshold: float = 0.8
    negative_threshold: float = 0.5
    max_positives: int = 200
    max_negatives: int = 300

    positive_windows: int = 10
    positive_overlap: float = 0.6
    negative_overlap: float = 0.2
    initial_warps: int = 20
    initial_rotation: float = 10.0
    warps: int = 10
    rotation: float = 5.0
    warp_scale: float = 0.01
    warp_shift: float = 0.01
    warp_noise: float = 5.0
    initial_negatives: int = 100
    learning_inside: float = 0.9

    valid_threshold: float = 0.62
    lost_threshold: float = 0.5
    steady_threshold: float = 0.4
    provisional_threshold: float = 0.58
    max_residual: float = 0.05
    doubt_inside: float = 0.3
    confirm_frames: int = 3
    persist_frames: int = 15
    patience_frames: int = 4
    unsteady_weight: int = 2
    grace_frames: int = 20
    widen_frames: int = 8

    align_step: float = 0.06
    align_gain: float = 0.45
    align_similarity: float = 0.8
    takeover_overlap: float = 0.5
    fusion_overlap: float = 0.7
    fusion_weight: float = 30.0

    sift_keypoints: int = 200
    sift_side: float = 96.0
    sift_pixels: int = 25000
    sift_views: int = 10
    sift_interval: int = 10
    sift_ratio: float = 0.75
    sift_error: float = 0.08
    sift_matches: int = 5

    witness_ratio: float = 0.8
    witness_error: float = 0.3
    witness_least: int = 3
    witness_enough: float = 0.5
    witness_expected: float = 4.0
    witness_few: float = 0.2
    witness_first: float = 0.4
    witness_rate: float = 0.05
    witness_views: int = 3

    depth_error: float = 0.03
    depth_motion: float = 0.1
    depth_size: float = 1.4
    depth_support: float = 0.2
    depth_front: float = 0.2
    depth_valid: float = 0.1

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            kind = type(field.default)
            if kind is float and type(value) is int:
                object.__setattr__(self, field.name, float(value))
            elif type(value) is not kind:
                raise ValueError(f"parameter {field.name} must be of type {kind.__name__}, got {value!r}")
            elif kind is int and value < 1:
                raise ValueError(f"parameter {field.name} must be at least 1, got {value}")
            elif kind is float and not 0.0 <= value < math.inf:
                raise ValueError(f"parameter {field.name} must not be negative or infinite, got {value}")
        if self.tracker not in TRACKERS:
            raise ValueError(f"parameter tracker must be one of {', '.join(TRACKERS)}, got {self.tracker!r}")
        for name, bound in LOWER_BOUNDS.items():
            if getattr(self, name) <= bound:
                raise ValueError(f"parameter {name} must exceed {bound:g}, got {getattr(self, name)}")
        if self.comparisons > MAX_COMPARISONS:
            raise ValueError(
                f"parameter comparisons must be at most {MAX_COMPARISONS}, got {self.comparisons}"
            )

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Parameters:
        """Build from a mapping of names to values; the rest keep their defaults.

        Raises
        ------
        ValueError
            For an unknown name, a value of the wrong type or one outside its range.
        """
        unknown = sorted(set(values) - {field.name for field in fields(cls)})
        if unknown:
            raise ValueError(f"unknown tracker parameter: {', '.join(unknown)}")
        return cls(**values)
