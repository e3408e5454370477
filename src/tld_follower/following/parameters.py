"""Parameters of the follower; `config/follower.yaml` gives each one's unit, meaning and default."""

from dataclasses import dataclass, fields

CONTROLS = ("thesis",)
DISTANCES = ("stereo", "box")
LATERALS = ("yaw", "strafe", "both")


@dataclass(frozen=True)
class Parameters:
    """Settings of the follower, SI units; checked when created."""

    control: str = "thesis"
    distance: str = "stereo"
    lateral: str = "yaw"
    image_width: int = 640
    image_height: int = 480
    set_distance: float = 1.0
    minimum_distance: float = 0.5
    clearance_hysteresis: float = 0.05
    max_speed: float = 1.0
    max_climb_rate: float = 0.5
    max_yaw_rate: float = 1.0
    distance_range: float = 0.6
    near_percentile: float = 10.0
    min_points: int = 50
    obstacle_fraction: float = 0.005
    descent_margin: float = 0.15
    camera_pitch: float = 0.34
    max_age: float = 0.3
    cloud_wait: float = 0.1

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            if field.type is float and type(value) is int:
                object.__setattr__(self, field.name, float(value))  # YAML writes 1 for 1.0
            elif type(value) is not field.type:
                raise ValueError(f"{field.name} must be of type {field.type.__name__}, not {value!r}")
            if field.type in (int, float) and not 0 < value < float("inf"):
                raise ValueError(f"{field.name} must be positive and finite, not {value!r}")
        for name, choices in (("control", CONTROLS), ("distance", DISTANCES), ("lateral", LATERALS)):
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
