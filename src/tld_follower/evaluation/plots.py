"""Plots and video of a flight, as thesis figures 4.3, 4.5 and 4.6 show theirs."""

import os
from contextlib import contextmanager

import cv2
import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.patches import Circle, Rectangle

from tld_follower.evaluation.film import picture
from tld_follower.evaluation.metrics import SET_DISTANCE
from tld_follower.following.follower import Mode
from tld_follower.nodes.conversions import message_box

TRUTH, FOUND, INK = "#5b6770", "#d1495b", "#222222"
_FRAME_STEP = 2  # every second frame goes into the video


def _axes(drive_s, title, unit):
    figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
    axes.axvspan(0, drive_s, color="#f2efe6", zorder=0)
    axes.text(
        drive_s / 2,
        0.98,
        "target moves",
        transform=axes.get_xaxis_transform(),
        ha="center",
        va="top",
        color=TRUTH,
    )
    axes.set(title=title, xlabel="time [s]", ylabel=unit)
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _save(figure, path):
    figure.savefig(path, dpi=110)
    plt.close(figure)


def plot_distance(runs, drive_s, title, path):
    """Plot the distance over time of every run, the first one in front (thesis figures 4.3 and 4.5)."""
    figure, axes = _axes(drive_s, title, "distance to the target [m]")
    axes.axhline(SET_DISTANCE, color=INK, linewidth=1, linestyle="--", label="set distance")
    for run in reversed(runs[1:]):
        axes.plot(run["trace"]["t"], run["trace"]["distance"], color=FOUND, alpha=0.25, linewidth=0.8)
    trace = runs[0]["trace"]
    measured = np.array(trace["measured_distance"], dtype=float)
    axes.plot(trace["t"], measured, color=TRUTH, linewidth=0.8, label="as measured by the drone")
    axes.plot(trace["t"], trace["distance"], color=FOUND, linewidth=1.8, label="true distance")
    axes.set_ylim(0, max(2.0, 1.1 * max(max(run["trace"]["distance"]) for run in runs)))
    axes.legend(loc="lower right", frameon=False)
    _save(figure, path)


def forward_velocities(trace):
    """Return the velocities of drone and target along the drone's heading, arrays (N,) in m/s."""
    yaw = np.array(trace["drone_attitude"])[:, 2]
    heading = np.column_stack([np.cos(yaw), np.sin(yaw)])
    return tuple(
        (np.array(trace[name])[:, :2] * heading).sum(axis=1) for name in ("drone_velocity", "target_velocity")
    )


def plot_velocity(run, drive_s, title, path):
    """Plot both vehicles' velocity along the drone's heading (thesis figure 4.6), and the command."""
    trace = run["trace"]
    drone, target = forward_velocities(trace)
    figure, axes = _axes(drive_s, title, "forward velocity [m/s]")
    axes.plot(trace["t"], np.array(trace["command"])[:, 0], color="#9aa5ad", linewidth=0.8, label="command")
    axes.plot(trace["t"], target, color=INK, linewidth=1.5, label="target")
    axes.plot(trace["t"], drone, color=FOUND, linewidth=1.5, label="follower")
    axes.legend(loc="center", frameon=False)
    _save(figure, path)


def plot_path(run, plan, title, path):
    """Plot from above what the vehicles drove and flew, with a line of sight every 2 s, and the obstacles.

    An obstacle that moves is drawn where it came nearest to the drone, its way dotted.
    """
    trace = run["trace"]
    drone, target = (np.array(trace[name])[:, :2] for name in ("drone_position", "target_position"))
    figure, axes = plt.subplots(figsize=(8, 6), layout="constrained")
    for obstacle in plan.obstacles:
        gaps = [
            float(obstacle.distance(place, t + plan.start)[0])
            for place, t in zip(drone[::10], trace["t"][::10], strict=True)
        ]
        x, y, yaw = obstacle.pose(trace["t"][10 * int(np.argmin(gaps))] + plan.start)
        length, width, _ = obstacle.size
        shape = (
            Circle((x, y), 0.5 * length)
            if obstacle.shape == "cylinder"
            else Rectangle(
                (x - 0.5 * length, y - 0.5 * width),
                length,
                width,
                angle=np.degrees(yaw),
                rotation_point="center",
            )
        )
        shape.set(facecolor="#cbb994", edgecolor="#8a7a58")
        axes.add_patch(shape)
        if len(obstacle.track) > 1:
            axes.plot(*np.array(obstacle.track)[:, 1:3].T, color="#8a7a58", linewidth=1, linestyle=":")
    labelled = None
    for i in range(0, len(drone), 60):
        axes.plot(*np.stack([drone[i], target[i]]).T, color="#bbbbbb", linewidth=0.8)
        if labelled is None or np.hypot(*(target[i] - labelled)) > 0.3:
            labelled = target[i]
            axes.annotate(f"{trace['t'][i]:.0f} s", labelled, fontsize=7, color=TRUTH)
    axes.plot(*target.T, color=INK, linewidth=1.5, label="target")
    axes.plot(*drone.T, color=FOUND, linewidth=1.5, label="follower")
    both = np.concatenate([drone, target])
    (left, low), (right, high) = both.min(axis=0) - 1.5, both.max(axis=0) + 1.5
    axes.set(title=title, xlabel="x [m]", ylabel="y [m]", xlim=(left, right), ylim=(low, high))
    axes.set_aspect("equal")
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.legend(loc="best", frameon=False)
    _save(figure, path)


@contextmanager
def _quiet():
    """Keep OpenCV's remark on WebM's codec tag, which it prints though all is well, off the terminal."""
    stderr = os.dup(2)
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 2)
    try:
        yield
    finally:
        os.dup2(stderr, 2)
        os.close(stderr)


class Video:
    """The left camera with the found box (green), the true one (white) and what the follower is doing."""

    def __init__(self, path, resolution, rate):
        with _quiet():
            self._writer = cv2.VideoWriter(
                str(path), cv2.VideoWriter_fourcc(*"VP80"), rate / _FRAME_STEP, resolution
            )
        if not self._writer.isOpened():
            raise OSError(f"cannot write a video to {path}")
        self._count = 0

    def add(self, frame, t):
        """Add one frame of a flight; `frame` holds its image, box, state and truth messages."""
        self._count += 1
        if self._count % _FRAME_STEP:
            return
        self._writer.write(annotate(frame, t))

    def close(self):
        """Finish the file."""
        self._writer.release()


def annotate(frame, t):
    """Draw boxes, mode and distances into a frame's image; returns BGR."""
    drawn = picture(frame["image"])
    truth, state = frame["truth"], frame["state"]
    for message, colour, width in ((truth.target_box, (255, 255, 255), 1), (frame["box"], (60, 220, 60), 2)):
        box = message_box(message)
        if box is not None:
            corners = [(round(box.x), round(box.y)), (round(box.right), round(box.bottom))]
            cv2.rectangle(drawn, *corners, colour, width)
    text = (
        f"{t:+6.2f} s  {Mode(state.mode).name}  true {truth.distance:.2f} m  measured {state.distance:.2f} m"
    )
    place = (8, drawn.shape[0] - 10)
    for colour, width in (((0, 0, 0), 3), ((255, 255, 255), 1)):
        cv2.putText(
            drawn,
            text,
            place,
            cv2.FONT_HERSHEY_SIMPLEX,
            drawn.shape[1] / 1200,
            colour,
            width,
            cv2.LINE_AA,
        )
    return drawn
