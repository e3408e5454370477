import pytest

from tld_follower.nodes.teleop import Keyboard


@pytest.fixture
def keyboard():
    return Keyboard(speed=0.5, turn=1.0, max_speed=0.6, max_turn=1.05)


def test_moves_and_stops(keyboard):
    assert not keyboard.moving
    for key, command in (
        ("i", (0.5, 0)),
        (",", (-0.5, 0)),
        ("j", (0, 1)),
        ("o", (0.5, -1)),
        (".", (-0.5, 1)),
    ):
        keyboard.press(key)
        assert keyboard.command() == command
    for key in ("k", " ", "\x1b"):
        keyboard.press("i")
        keyboard.press(key)
        assert keyboard.command() == (0, 0)
        assert not keyboard.moving


def test_speeds_change_within_the_limits(keyboard):
    keyboard.press("i")
    keyboard.press("w")
    assert keyboard.command() == (pytest.approx(0.55), 0)
    for _ in range(9):
        keyboard.press("q")
    assert (keyboard.speed, keyboard.turn) == (0.6, 1.05)
