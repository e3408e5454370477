"""Parameters of the follower; `config/follower.yaml` gives each one's unit, meaning and default."""

import math
from dataclasses import dataclass, fields

CONTROLS = ("predictive", "thesis")
VEHICLES = ("uav", "ugv")
DISTANCES = ("stereo", "box")
LATERALS = ("yaw", "strafe", "both")


_ANY_SIGN = ("camera_pitch", "camera_x", "camera_y", "camera_z")
_MAY_BE_ZERO = ("search_time", "lost_hover", "coast_time", "near_margin", "near_ahead", "anticipation")


def _allowed(name, value):
    if name in _ANY_SIGN:
        return math.isfinite(value)
    return math.isfinite(value) and (value > 0 or (value == 0 and name in _MAY_BE_ZERO))


@dataclass(frozen=True)
class Parameters:
    """Settings of the follower, SI units; checked when created."""

    control: str = "predictive"
    vehicle: str = "uav"
    distance: str = "stereo"
    lateral: str = "yaw"
    image_width: int = 640
    image_height: int = 480
    hfov: float = 1.1344640138
    camera_pitch: float = 0.34
    camera_x: float = 0.08
    camera_y: float = 0.0295
    camera_z: float = -0.0165
    set_distance: float = 1.0
    minimum_distance: float = 0.5
    max_speed: float = 1.0
    max_climb_rate: float = 0.5
    max_yaw_rate: float = 1.5
    max_slew: float = 30.0
    max_age: float = 0.3
    cloud_wait: float = 0.1
    near_percentile: float = 10.0
    near_share: float = 0.04
    min_points: int = 50
    obstacle_fraction: float = 0.005
    # thesis
    distance_range: float = 0.6
    clearance_hysteresis: float = 0.05
    descent_margin: float = 0.15
    # predictive
    range_sigma: float = 0.003
    range_gate: float = 0.25
    gate_frames: int = 15
    target_acceleration: float = 1.5
    manoeuvre_acceleration: float = 8.0
    target_radius: float = 2.0
    target_climb: float = 2.0
    velocity_lag: float = 0.294
    tilt_lag: float = 0.1
    max_acceleration: float = 3.5
    far_pole: float = 5.0
    near_pole: float = 8.0
    anticipation: float = 0.15
    give_way_range: float = 0.1
    yaw_gain: float = 2.5
    climb_gain: float = 1.5
    strafe_gain: float = 1.5
    # safe motion
    body_radius: float = 0.25
    body_height: float = 0.1
    clearance: float = 0.35
    clearance_below: float = 0.4
    near_margin: float = 0.1
    near_ahead: float = 0.3
    braking: float = 2.5
    reaction_time: float = 0.25
    leave_gain: float = 5.0
    unknown_speed: float = 0.5
    threat_time: float = 1.0
    map_range: float = 4.0
    map_memory: float = 30.0
    # search
    lost_hover: float = 0.3
    search_time: float = 30.0
    search_speed: float = 1.2
    search_climb: float = 0.5
    sweep_rate: float = 0.9
    coast_time: float = 4.0
    go_limit: float = 8.0

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            if field.type is float and type(value) is int:
                object.__setattr__(self, field.name, float(value))  # YAML writes 1 for 1.0
            elif type(value) is not field.type:
                raise ValueError(f"{field.name} must be of type {field.type.__name__}, not {value!r}")
            if field.type in (int, float) and not _allowed(field.name, value):
                raise ValueError(f"{field.name} must be positive and finite, not {value!r}")
        for name, choices in (
            ("control", CONTROLS),
            ("vehicle", VEHICLES),
            ("distance", DISTANCES),
            ("lateral", LATERALS),
        ):
            if getattr(self, name) not in choices:
                raise ValueError(f"{name} must be one of {', '.join(choices)}, not {getattr(self, name)!r}")
        for name, most in (("near_percentile", 100.0), ("obstacle_fraction", 0.5), ("camera_pitch", 1.5)):
            if getattr(self, name) > most:
                raise ValueError(f"{name} must be at most {most}, not {getattr(self, name)!r}")
        if self.minimum_distance >= self.set_distance:
            raise ValueError(
                f"minimum_distance {self.minimum_distance} must be below set_distance {self.set_distance}"
            )

    @classmethod
    def from_dict(cls, values):
        """Create from a mapping; an unknown name raises ValueError."""
        unknown = sorted(set(values) - {field.name for field in fields(cls)})
        if unknown:
            raise ValueError(f"unknown parameter of the follower: {', '.join(unknown)}")
        return cls(**values)
