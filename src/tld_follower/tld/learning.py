# SPDX-License-Identifier: BSD-3-Clause
"""P-N learning: examples for the detector from one confirmed box (thesis section 3.1.3; Kalal 2012)."""

from __future__ import annotations

import cv2
import numpy as np

from tld_follower.box import Box
from tld_follower.tld.detector import Detections, Detector, overlaps
from tld_follower.tld.ferns import fern_codes
from tld_follower.tld.frame import Frame
from tld_follower.tld.object_model import relative_similarity, similarity_to
from tld_follower.tld.parameters import Parameters
from tld_follower.tld.windows import WindowSize

# The first examples are shown twice, as in Kalal's bootstrap: in the second round trained ferns judge them.
INITIAL_ROUNDS = 2
# The texture of noise is larger than any view by at least this [pixel].
NOISE_ROOM = 64


class Learner:
    """Trains a detector: windows on the target are positive, all far from it negative (P-N constraints)."""

    def __init__(self, detector: Detector, parameters: Parameters, rng: np.random.Generator) -> None:
        self._detector = detector
        self._parameters = parameters
        self._rng = rng
        self._texture = self._noise_texture()

    def _noise_texture(self) -> np.ndarray:
        """Make the texture that `_noise` cuts from, larger than any view of the target.

        A view holds windows that overlap the target's box by p or more. Along an axis, a window of length w
        then shares p (w + b) / (1 + p) with a box of length b, and sqrt(p) b is at most w. So the view, the
        box and what windows have outside it on both sides, is at most as long as below.
        """
        parameters = self._parameters
        sizes = np.array([size.grid[1::-1] for size in self._detector.sizes])
        least = parameters.positive_overlap
        length = (2.0 + (1.0 - least) / np.sqrt(least)) / (1.0 + least)
        margin = NOISE_ROOM + 2 * _reach(parameters)
        height, width = np.ceil(length * sizes.max(axis=0)).astype(int) + margin
        noise = np.random.default_rng(0).standard_normal((height, width), np.float32)
        return cv2.GaussianBlur(noise * np.float32(parameters.warp_noise), (0, 0), parameters.blur)

    def initialise(self, frame: Frame, box: Box) -> None:
        """Train on the first frame, and raise both thresholds above half of its background, held out.

        Parameters
        ----------
        frame, box : the target's first view [pixel].
        """
        parameters, detector, rng = self._parameters, self._detector, self._rng
        positive = self._warped_codes(frame, box, parameters.initial_warps, parameters.initial_rotation)
        background = detector.scan(frame, box, parameters.scales, -1.0)
        far = overlaps(background.boxes, np.array(box.as_tuple())) < parameters.negative_overlap
        order = rng.permutation(np.flatnonzero(far))
        training, held_out = order[: len(order) // 2], order[len(order) // 2 :]
        codes = np.concatenate([positive, background.codes[training]])
        labels = np.arange(len(codes)) < len(positive)
        for _ in range(INITIAL_ROUNDS):
            shuffled = rng.permutation(len(codes))
            self._train(codes[shuffled], labels[shuffled])
        if len(held_out):
            seen = float(detector.ferns.confidence(background.codes[held_out]).max())
            detector.fern_threshold = max(parameters.fern_threshold, seen)

        model = detector.model
        model.positives.add(frame.patches(np.array([box.as_tuple()]))[0])
        chosen = order[: parameters.initial_negatives]
        patches = frame.patches(background.boxes[chosen])
        half = (len(patches) + 1) // 2
        self._add_negatives(patches[:half])
        if len(patches) > half:
            seen = float(model.similarity(patches[half:]).relative.max())
            detector.nn_threshold = max(parameters.nn_threshold, seen)
        self.update(frame, box, detector.detect(frame, box, parameters.scales))

    def update(self, frame: Frame, box: Box, detections: Detections) -> None:
        """Train on one frame whose box is trusted.

        The detector's candidates far from the box are negative, the windows nearest to it, warped, positive.
        """
        parameters, detector = self._parameters, self._detector
        far = overlaps(detections.boxes, np.array(box.as_tuple())) < parameters.negative_overlap
        positive = self._warped_codes(frame, box, parameters.warps, parameters.rotation)
        codes = np.concatenate([positive, detections.codes[far]])
        labels = np.arange(len(codes)) < len(positive)
        shuffled = self._rng.permutation(len(codes))
        self._train(codes[shuffled], labels[shuffled])

        patch = frame.patches(np.array([box.as_tuple()]))
        if detector.model.similarity(patch).relative[0] < parameters.positive_threshold:
            detector.model.positives.add(patch[0])
        self._add_negatives(detections.patches[far])

    def _train(self, codes: np.ndarray, labels: np.ndarray) -> None:
        self._detector.ferns.train(
            codes, labels, self._detector.fern_threshold, self._parameters.fern_threshold
        )

    def _add_negatives(self, patches: np.ndarray) -> None:
        """Add those that the model, with the ones before them, takes for the target."""
        model = self._detector.model
        compared = model.similarity(patches)
        positive, negative = compared.positive, compared.negative
        while len(patches):
            similarity = relative_similarity(positive, negative)
            worst = int(np.argmax(similarity))
            wrong = similarity > self._parameters.negative_threshold
            if not wrong[worst]:
                return
            added = patches[worst : worst + 1]
            model.negatives.add(added[0])
            wrong[worst] = False
            patches, positive, negative = patches[wrong], positive[wrong], negative[wrong]
            negative = np.maximum(negative, similarity_to(added, patches))

    def _warped_codes(self, frame: Frame, box: Box, warps: int, rotation: float) -> np.ndarray:
        """Fern codes of the windows nearest to a box, as they are and in warped views of it.

        Returns
        -------
        (N, ferns) int32
        """
        groups = self._nearest_windows(frame, box)
        codes = [np.zeros((0, self._detector.ferns.count), np.int32)]
        for octave in sorted({size.octave for size, _ in groups}):
            members = [(size, corners) for size, corners in groups if size.octave == octave]
            codes.extend(self._octave_codes(frame, box, members, warps, rotation))
        return np.concatenate(codes)

    def _octave_codes(
        self, frame: Frame, box: Box, groups: list[tuple[WindowSize, np.ndarray]], warps: int, rotation: float
    ) -> list[np.ndarray]:
        parameters, rng = self._parameters, self._rng
        octave, factor = groups[0][0].octave, groups[0][0].factor
        level = frame.level(octave)
        # The crop holds all windows and the reach of the blur about them.
        reach = _reach(parameters)
        low = np.min([corners.min(axis=0) for _, corners in groups], axis=0) - reach
        high = np.max([corners.max(axis=0) + np.rint(s.grid[:2]) for s, corners in groups], axis=0) + reach
        x0, y0 = np.maximum(low, 0).tolist()
        x1, y1 = np.minimum(high, level.gray.shape[::-1]).astype(int).tolist()
        local = [(np.ascontiguousarray(c - [x0, y0], np.int32), s.offsets) for s, c in groups]
        center = np.array(box.center) / factor - [x0, y0] - 0.5
        extent = np.array([box.width, box.height]) / factor
        view = level.blurred[y0:y1, x0:x1]
        codes = [fern_codes(view, c, o) for c, o in local]
        for _ in range(warps):
            angle = rng.uniform(-rotation, rotation)
            scale = 1.0 + rng.uniform(-parameters.warp_scale, parameters.warp_scale)
            matrix = cv2.getRotationMatrix2D(center.tolist(), angle, scale)
            matrix[:, 2] += rng.uniform(-parameters.warp_shift, parameters.warp_shift, 2) * extent
            warped = cv2.warpAffine(view, matrix, view.shape[::-1], borderMode=cv2.BORDER_REPLICATE)
            noisy = cv2.add(warped, self._noise(*view.shape), dtype=cv2.CV_8U)
            codes.extend(fern_codes(noisy, c, o) for c, o in local)
        return codes

    def _noise(self, rows: int, columns: int) -> np.ndarray:
        """Return blurred noise (rows, columns) float32, another part of the texture in each call.

        Blur and warp commute but for the change of scale, so a warped view of the blurred image with blurred
        noise stands for the blurred image of a warped, noisy view at a fraction of the cost.
        """
        room = (self._texture.shape[0] - rows, self._texture.shape[1] - columns)
        y, x = (int(self._rng.integers(0, most + 1)) for most in room)
        return self._texture[y : y + rows, x : x + columns]

    def _nearest_windows(self, frame: Frame, box: Box) -> list[tuple[WindowSize, np.ndarray]]:
        """Find the `positive_windows` windows that overlap a box most, at least by `positive_overlap`.

        Returns
        -------
        pairs of a size and its windows' corners (N, 2) int32 in its level.
        """
        parameters = self._parameters
        target = np.array(box.as_tuple())
        found = []
        for size in self._detector.sizes:
            ratio = size.width * size.height / box.area
            if min(ratio, 1.0 / ratio) < parameters.positive_overlap:
                continue
            corners = _corners_near(size, box, frame)
            shared = overlaps(size.boxes(corners), target)
            found.append((size, corners, shared))
        if not found:
            return []
        everything = np.concatenate([shared for _, _, shared in found])
        if len(everything) == 0:
            return []
        rank = min(parameters.positive_windows, len(everything))
        limit = max(np.partition(everything, -rank)[-rank], parameters.positive_overlap)
        groups = [(size, corners[shared >= limit]) for size, corners, shared in found]
        return [(size, corners) for size, corners in groups if len(corners)]


def _reach(parameters: Parameters) -> int:
    """How far the blur reaches [pixel of the octave]."""
    return int(np.ceil(2.0 * parameters.blur))


def _corners_near(size: WindowSize, box: Box, frame: Frame) -> np.ndarray:
    """Corners (N, 2) int32 of the windows of one size whose corner is within half a box of the box's."""
    width, height, step_x, step_y = size.grid
    limits = (
        (box.x, box.width, step_x, frame.width // size.factor - round(width)),
        (box.y, box.height, step_y, frame.height // size.factor - round(height)),
    )
    axes = []
    for start, side, step, last in limits:
        first = max(0, int(np.ceil((start - 0.5 * side) / size.factor / step)))
        final = int((start + 0.5 * side) / size.factor / step)
        positions = np.rint(np.arange(first, final + 1) * step).astype(np.int32)
        axes.append(positions[positions <= last])
    x, y = np.meshgrid(*axes)
    return np.stack([x.ravel(), y.ravel()], axis=1)
