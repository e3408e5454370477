"""/teleop_twist_keyboard: drives Husky from the terminal that the node was started in."""

import math
import os
import select
import sys
import termios
import threading
import tty

import rospy
from geometry_msgs.msg import Twist

from tld_follower.nodes.settings import checked, fatal_if_wrong

# key -> (forward, turn left), in units of the speed and the turn rate
MOVES = {
    "u": (1, 1), "i": (1, 0), "o": (1, -1),
    "j": (0, 1), "k": (0, 0), "l": (0, -1),
    "m": (-1, -1), ",": (-1, 0), ".": (-1, 1),
    " ": (0, 0),
}  # fmt: skip
# key -> factors of the speed and the turn rate
CHANGES = {
    "q": (1.1, 1.1),
    "z": (1 / 1.1, 1 / 1.1),
    "w": (1.1, 1),
    "x": (1 / 1.1, 1),
    "e": (1, 1.1),
    "c": (1, 1 / 1.1),
}

HELP = """Drive Husky:
   u    i    o        q/z  speed and turn rate up/down by 10 %
   j    k    l        w/x  speed only
   m    ,    .        e/c  turn rate only
k or space stops, Ctrl-C quits. A motion goes on until another key is pressed."""


class Keyboard:
    """What the keys pressed so far ask for: speed in m/s, turn rate in rad/s, and the motion."""

    def __init__(self, speed, turn, max_speed, max_turn):
        self.speed, self.turn = speed, turn
        self._max_speed, self._max_turn = max_speed, max_turn
        self._move = (0, 0)

    def press(self, key):
        """Take a key; a key without a meaning stops."""
        if key in CHANGES:
            speed, turn = CHANGES[key]
            self.speed = min(self.speed * speed, self._max_speed)
            self.turn = min(self.turn * turn, self._max_turn)
        else:
            self._move = MOVES.get(key, (0, 0))

    @property
    def moving(self):
        """Whether a motion is asked for."""
        return self._move != (0, 0)

    def command(self):
        """Forward speed in m/s and turn rate in rad/s, left positive."""
        return self._move[0] * self.speed, self._move[1] * self.turn


def drive(keyboard, publisher, period):
    """Read keys and publish until ROS shuts down; the motion is repeated, a stop is sent once."""
    settings = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        moved = False
        while not rospy.is_shutdown():
            if select.select([sys.stdin], [], [], period)[0]:
                key = os.read(sys.stdin.fileno(), 1).decode(errors="replace")
                if not key:
                    rospy.logwarn("the terminal is gone: no more keys")
                    break
                keyboard.press(key)
            if keyboard.moving or moved:
                message = Twist()
                message.linear.x, message.angular.z = keyboard.command()
                publisher.publish(message)
            moved = keyboard.moving
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSADRAIN, settings)


def main():
    """Run the node until ROS shuts down; without a terminal it says so and stays idle."""
    rospy.init_node("teleop_twist_keyboard")
    publisher = rospy.Publisher("/husky/cmd_vel", Twist, queue_size=1)
    defaults = {"speed": 1.0, "turn": 1.0, "max_speed": 1.0, "max_turn": 2.0}
    with fatal_if_wrong():
        keyboard = Keyboard(
            **{
                name: checked(rospy.get_param(f"~{name}", value), name, float, lambda x: 0 < x < math.inf)
                for name, value in defaults.items()
            }
        )
    if sys.stdin is None or not sys.stdin.isatty():
        rospy.loginfo(
            "no terminal to read keys from: staying idle; run 'rosrun tld_follower teleop_twist_keyboard'"
        )
        rospy.spin()
        return
    print(HELP, flush=True)
    rospy.on_shutdown(lambda: publisher.publish(Twist()))
    # A wall-clock period well inside Husky's command timeout of 0.25 s; ROS time may stand still.
    worker = threading.Thread(target=drive, args=(keyboard, publisher, 0.1), daemon=True)
    worker.start()
    rospy.spin()
    worker.join(timeout=1.0)
