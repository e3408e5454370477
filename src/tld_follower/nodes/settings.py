"""Checks of the parameters that belong to a node itself."""

from contextlib import contextmanager

import rospy


@contextmanager
def fatal_if_wrong():
    """End the node with one fatal message where its parameters raise ValueError."""
    try:
        yield
    except ValueError as error:
        rospy.logfatal(str(error))
        raise SystemExit(1) from error


def checked(value, name, kind, allowed=lambda value: True):
    """Return a parameter's value if it is of its kind and allowed; ValueError names it otherwise.

    `kind` is bool, int, float or str; a whole number will do for a float.
    """
    if kind is float and type(value) is int:
        value = float(value)
    if type(value) is not kind or not allowed(value):
        raise ValueError(f"parameter {name} can't be {value!r}")
    return value
