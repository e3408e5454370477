# SPDX-License-Identifier: BSD-3-Clause
"""Shoots films of a scripted scenario with the simulator alone: no tracker, no follower."""

import tempfile
from contextlib import closing
from pathlib import Path

import rospy

from tld_follower.evaluation import graph
from tld_follower.evaluation.film import Film
from tld_follower.evaluation.sequences import SequenceError
from tld_follower.evaluation.stage import Stage, simulation_arguments


def shoot(scenario, seeds, directory, resolution="320x240", image_noise=1.0):
    """Shoot a film of each seed, the same one that `experiment --film` saves.

    Parameters
    ----------
    scenario : function of a seed that returns a Plan
        One that flies the drone by a script.
    seeds : iterable of int
    directory : Path
        Gets one sequence folder a film, SCENARIO-SEED.
    resolution : str
        WxH in pixels.
    image_noise : float
        Standard deviation in grey levels.

    Returns
    -------
    list of Path
        The sequence folders.

    Raises
    ------
    SequenceError
        If the simulator does not run or a film cannot be written.
    """
    try:
        return _shoot(scenario, seeds, directory, resolution, image_noise)
    except (graph.GraphError, rospy.ROSException, OSError) as error:
        raise SequenceError(f"{scenario.__name__} cannot be filmed: {error}") from error


def _shoot(scenario, seeds, directory, resolution, image_noise):
    logs = Path(tempfile.mkdtemp(prefix="tld_follower-films-"))
    folders = []
    with graph.private_master(logs):
        rospy.init_node("films", disable_signals=True)
        for seed in seeds:
            plan = scenario(seed)
            name = f"{plan.scenario}-{seed}"
            folders.append(directory / name)
            arguments = simulation_arguments(plan, seed, resolution, image_noise, logs)
            with (
                closing(Film(folders[-1])) as film,
                closing(Stage(plan, ("truth", "image"))) as stage,
                graph.launched("sim.launch", arguments, logs / f"{name}.log") as alive,
            ):
                stage.wait_until_connected(alive=alive)
                for t, frame in stage.frames(alive):
                    if t >= plan.box_at:
                        film.add(frame, t)
        rospy.signal_shutdown("done")
    return folders
