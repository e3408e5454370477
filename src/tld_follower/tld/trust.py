# SPDX-License-Identifier: BSD-3-Clause
"""What the trajectory is worth: when a tracked box may be shown, and when it may be learnt from."""

from __future__ import annotations

from tld_follower.tld.parameters import Parameters
from tld_follower.tld.redetection import Witness


class Trust:
    """The evidence for the box that is followed.

    The target's look and the motion of its points are two witnesses. A trajectory whose points always moved
    together is the target even where its look is new; once they did not, at an occlusion, the look must do.
    Keypoints, where the target has them, are a third: recognised, they make up for a weak look; missed, they
    end the showing of a box in doubt.

    Attributes
    ----------
    valid : the trajectory has been confirmed by the model (Kalal 2012); only then may it be learnt from.
    missed : frames since a box was last shown.
    """

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self.valid = True
        self.missed = 0
        self._doubtful = False
        self._provisional = False
        self._weak = 0
        self._steady = parameters.confirm_frames
        self._shown = 0
        self._alike = 0

    @property
    def learnable(self) -> bool:
        """True if the frame seen last may teach the detector."""
        return self.valid and self._steady > 0

    def restart(self, provisional: bool) -> None:
        """Begin a new trajectory where the detector found the target.

        Parameters
        ----------
        provisional : the evidence was weak; the next frame must confirm it before a box is shown.
        """
        self.valid = False
        self._doubtful = True
        self._provisional = provisional
        self._weak = 0
        self._steady = 0
        self._shown = 0
        self._alike = 0

    def doubt(self) -> None:
        """Ask for more than steady points from here on: they may be the background's."""
        self._doubtful = True

    def vouch(self) -> None:
        """Take in a frame in which depth shows the target in its place: what it looks like is no matter."""
        self._doubtful = self._provisional = False
        self._weak = 0
        self._steady += 1
        self._shown += 1

    def drop(self) -> None:
        """End the trajectory."""
        self.valid = False
        self._provisional = False
        self._steady = 0

    def observe(
        self,
        residual: float,
        relative: float,
        conservative: float,
        accepted: float,
        witness: Witness = Witness.SILENT,
    ) -> bool:
        """Take in one tracked frame.

        Parameters
        ----------
        residual : of the flow, see `median_flow.Flow`.
        relative, conservative : similarities of the tracked box, 0..1.
        accepted : relative similarity at which the detector is sure.
        witness : what the target's keypoints say, if there are any.

        Returns
        -------
        True if the box may be shown.
        """
        parameters = self._parameters
        steady = residual <= parameters.max_residual
        self._doubtful = self._doubtful or not steady
        if self._provisional:
            needed = parameters.provisional_threshold
        elif self._doubtful or not self.valid:
            needed = parameters.lost_threshold
        else:
            needed = parameters.steady_threshold
        if witness is Witness.FOR:
            needed = min(needed, parameters.steady_threshold)
        sure = relative > accepted - parameters.redetection_margin
        if relative < needed or (witness is Witness.AGAINST and self._doubtful and not sure):
            self._steady = self._shown = self._alike = 0
            return False
        self._provisional = False
        if sure or not self._doubtful or witness is Witness.FOR:
            self._weak = 0
        else:
            self._weak += 1 if steady else parameters.unsteady_weight
        if self._weak > parameters.patience_frames:
            self._shown = 0
            return False
        certain = parameters.provisional_threshold if self._doubtful else parameters.lost_threshold
        self._steady = self._steady + 1 if steady and relative >= certain else 0
        self._shown = self._shown + 1 if steady else 0
        proven = self.valid or relative > accepted
        if (self._steady > parameters.confirm_frames and proven) or self._shown > parameters.persist_frames:
            self._doubtful = False
        self._alike = self._alike + 1 if conservative > parameters.valid_threshold else 0
        self.valid = self.valid or self._alike >= parameters.confirm_frames
        return True

    @property
    def provisional(self) -> bool:
        """True until the first frame after a weak detection has confirmed it."""
        return self._provisional
