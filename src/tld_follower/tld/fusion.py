# SPDX-License-Identifier: BSD-3-Clause
"""Where the target went by flow, detector and model together (thesis section 3.1.4)."""

from __future__ import annotations

import numpy as np

from tld_follower.box import Box
from tld_follower.tld import median_flow
from tld_follower.tld.alignment import align, blend
from tld_follower.tld.detector import Detections, Detector, overlaps
from tld_follower.tld.frame import Frame
from tld_follower.tld.median_flow import Flow
from tld_follower.tld.object_model import ObjectModel
from tld_follower.tld.parameters import Parameters


def follow(previous: Frame, frame: Frame, box: Box, points: np.ndarray, parameters: Parameters) -> list[Flow]:
    """Follow a box by median flow; where that fails, once more from where the target's picture is found.

    Parameters
    ----------
    box : the target in `previous` [pixel].
    points : (N, 2) float32 in `previous` [pixel].

    Returns
    -------
    the motions found, see `median_flow.track`.
    """
    flows = median_flow.track(previous, frame, box, points, parameters)
    if not flows or flows[0].residual > parameters.max_residual:
        guess = median_flow.search(previous, frame, box)
        again = median_flow.track(previous, frame, box, points, parameters, guess)
        if again and (not flows or again[0].residual < flows[0].residual):
            return again
    return flows


def most_alike(frame: Frame, model: ObjectModel, flows: list[Flow], margin: float) -> Flow | None:
    """Choose between motions by the look of where they lead.

    Parameters
    ----------
    margin : similarity S+ by which another motion than the first must lead to a view more alike.
    """
    if len(flows) < 2:
        return flows[0] if flows else None
    similarity = model.positive_similarity(frame.patches(np.array([flow.box.as_tuple() for flow in flows])))
    similarity[0] += margin
    return flows[int(np.argmax(similarity))]


def refine(
    frame: Frame, detector: Detector, flow: Flow, detections: Detections, parameters: Parameters
) -> Box:
    """Correct the tracked box by the detections that agree with it, then by the model itself.

    The box's centre weighs `fusion_weight`, that of each detection 1 (Kalal 2012). Its size stays: the
    windows' sizes are a whole scale step apart and would pull it down step by step. The model corrects it
    the less the better the flow held together: then the tracker is the more precise of the two.
    """
    tracked = np.array(flow.box.as_tuple())
    near = overlaps(detections.boxes, tracked) > parameters.fusion_overlap
    near &= detections.similarity.relative > detector.nn_threshold
    centers = detections.boxes[near, :2] + 0.5 * detections.boxes[near, 2:]
    total = parameters.fusion_weight * np.array(flow.box.center) + centers.sum(axis=0)
    center = total / (parameters.fusion_weight + np.count_nonzero(near))
    box = Box.from_center(*map(float, center), flow.box.width, flow.box.height)
    aligned, similarity = align(frame, detector.model, box, parameters.align_step)
    if similarity < parameters.align_similarity:
        return box
    return blend(box, aligned, parameters.align_gain * min(1.0, flow.residual / parameters.max_residual))
