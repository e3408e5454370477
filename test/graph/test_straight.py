#!/usr/bin/env python3
"""Spiri follows Husky through camera images alone: 12 s at 1 m/s, then a halt."""

import sys
import unittest

import rospy

from tld_follower.evaluation.flight import Flight
from tld_follower.evaluation.metrics import flight_figures
from tld_follower.evaluation.scenarios import straight
from tld_follower.msg import FollowState


class StraightTest(unittest.TestCase):
    def test_follows_all_the_way(self):
        rospy.init_node("straight_test")
        plan = straight(0)
        flight = Flight(plan)
        flight.wait_until_connected()
        trace, _ = flight.fly()
        figures = flight_figures(trace, plan.drive_s, plan.figures)
        rospy.loginfo("%s", figures)

        travelled = trace["drone_position"][-1][0] - trace["drone_position"][0][0]
        self.assertGreater(travelled, 10.0)
        self.assertEqual(figures["collisions"], 0)
        self.assertGreater(figures["min_clearance_m"], 0.3)
        self.assertGreaterEqual(figures["tracked_fraction"], 0.95)
        self.assertGreaterEqual(figures["mean_overlap"], 0.6)
        # A follower that ignores the depth lets the gap grow by metres, or runs into the target.
        self.assertLess(figures["peak_gap_m"], 0.8)
        self.assertLess(figures["steady_error_m"], 0.5)
        self.assertLess(figures["overshoot_m"], 0.3)
        self.assertIn(FollowState.FOLLOWING, trace["mode"])
        # The distance that the drone measures is the true one, not just a number that keeps it flying.
        pairs = zip(trace["measured_distance"], trace["distance"], strict=True)
        errors = sorted(abs(measured - true) for measured, true in pairs if measured is not None)
        self.assertGreater(len(errors), 0.95 * len(trace["t"]))
        self.assertLess(errors[int(0.9 * len(errors))], 0.15)


if __name__ == "__main__":
    import rostest

    sys.exit(rostest.rosrun("tld_follower", "straight", StraightTest, sys.argv))
