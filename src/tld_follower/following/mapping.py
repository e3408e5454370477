"""The mapping function of thesis equation 3.10."""


def map_range(x, in_min, in_max, out_min, out_max):
    """Map `x` linearly from one range to another (thesis eq. 3.10).

    f(x) = (x - in_min) (out_max - out_min) / (in_max - in_min) + out_min

    Values outside the input range map outside the output range; reversed ranges are allowed.
    """
    return (x - in_min) * (out_max - out_min) / (in_max - in_min) + out_min


def to_velocity(displacement, displacement_max, velocity_max):
    """Velocity that undoes a displacement, by eq. 3.10 on its magnitude and capped at `velocity_max`.

    The thesis maps 0..160 pixels to 0..1 m/s; a negative displacement gives a negative velocity.
    """
    speed = map_range(abs(displacement), 0.0, displacement_max, 0.0, velocity_max)
    return min(speed, velocity_max) * (1.0 if displacement >= 0 else -1.0)
