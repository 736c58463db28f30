"""The overlap of estimated and true masks over several pictures."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

LEAST_IOU = 0.1
"""IoU with the true masks of its own calibration pictures below which a defense has learnt nothing."""


class MaskIou:
    """Sums intersections and unions of masks over pictures."""

    def __init__(self) -> None:
        self._both = self._either = 0

    def update(self, estimated: npt.NDArray[np.bool_], truth: npt.NDArray[np.bool_]) -> None:
        """Adds one picture.

        Args:
            estimated, truth: (H, W) bool masks.
        """
        self._both += int((estimated & truth).sum())
        self._either += int((estimated | truth).sum())

    @property
    def value(self) -> float:
        """The intersection over union of all pictures together, 0..1; 0 if all masks are empty."""
        return self._both / self._either if self._either else 0.0


def overlap_problems(defense: str, iou: float) -> tuple[str, ...]:
    """Returns the problem of a calibration whose masks do not overlap the patches, for its report; empty otherwise.

    Args:
        defense: name of the defense, for the message.
        iou: IoU of estimated and true masks on the calibration pictures, 0..1.
    """
    if iou >= LEAST_IOU:
        return ()
    return (f"{defense} learnt nothing: on its own calibration patches its mask has an IoU of {iou:.3f}",)
