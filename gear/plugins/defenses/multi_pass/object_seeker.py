"""ObjectSeeker (Xiang et al., IEEE S&P 2023): adds objects that a detector finds if half of the picture is covered.

It follows the authors' code (objseeker/defense.py, pruning by intersection over area).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gear.contracts.defenses import DefenseResult
from gear.contracts.models import BatchPredictor, Model
from gear.formats.coco import Detection
from gear.plugins.defenses.multi_pass.boxes import merged, pruned
from gear.plugins.defenses.multi_pass.options import ObjectSeekerConfig
from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor, nn

Views = Mapping[str, UInt8Image]
Half = tuple[slice, slice]


def partition_points(height: int, width: int, lines: int) -> list[tuple[int, int]]:
    """Returns the rows and columns at which the picture is split, (row, column) from the top left to the bottom right.

    Args:
        height, width: size of the picture in pixels.
        lines: number of lines in each direction; small pictures have fewer.
    """
    down, across = math.ceil(height / (lines + 1)), math.ceil(width / (lines + 1))
    return list(zip(range(down, height, down), range(across, width, across), strict=False))


def covered_halves(row: int, column: int) -> tuple[Half, Half, Half, Half]:
    """Returns the four parts that are covered at a partition point: above, below, left of it and right of it.

    Args:
        row, column: the partition point in pixels.
    """
    whole = slice(None)
    return (
        (slice(None, row), whole),
        (slice(row, None), whole),
        (whole, slice(None, column)),
        (whole, slice(column, None)),
    )


class SeekingModel:
    """A detector that also searches the picture with halves of it covered in black.

    A patch lies in a covered half at some partition point, whatever its content. The detector then sees the objects of
    the other half without it. Boxes of masked pictures that no box of the whole picture explains are merged and added.

    Args:
        model: the detector.
        settings: options of the defense.
    """

    def __init__(self, model: Model, settings: ObjectSeekerConfig) -> None:
        self._model, self._settings = model, settings

    def predict(self, views: Views) -> tuple[Detection, ...]:
        """Returns the boxes of the whole picture, and those that only masked pictures show.

        Args:
            views: (H, W, 3) uint8 pictures of the sample by camera name; all are masked alike.
        """
        settings = self._settings
        base = list(self._model.predict(views))
        sure = [one for one in base if one.score > settings.base_confidence]
        found: list[Detection] = []
        for shown in self._masked(views):
            for detections in self._predict_many(shown):
                confident = [one for one in detections if one.score > settings.masked_confidence]
                found += pruned(confident, sure, settings.prune_share)
        return (*base, *merged(found))

    def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
        """Returns the outputs of the bare detector, or the mean losses over the whole and four masked pictures.

        The masked pictures are those of the middle partition point. All partition points would need 4 passes each, and
        an attack that hides its objects in the four halves of the middle one hides them in most others, too.

        Args:
            views: (B, 3, H, W) float pictures in 0..1 by camera name.
            targets: the batch's samples; None for outputs.
        """
        if targets is None:
            return self._model.forward(views)
        height, width = next(iter(views.values())).shape[2:]
        shown = [views]
        for rows, columns in covered_halves(height // 2, width // 2):
            masked = {name: pictures.clone() for name, pictures in views.items()}
            for pictures in masked.values():
                pictures[:, :, rows, columns] = 0
            shown.append(masked)
        losses = [self._model.forward(one, targets) for one in shown]
        means: dict[str, Tensor] = {}
        for name in losses[0]:
            means[name] = sum((one[name] for one in losses[1:]), losses[0][name]) / len(losses)
        return means

    def taps(self) -> Mapping[str, nn.Module]:
        """The modules of the bare detector whose outputs are feature maps, by name."""
        return self._model.taps()

    def _masked(self, views: Views) -> Iterator[list[Views]]:
        """Yields the four masked samples of each partition point."""
        height, width = next(iter(views.values())).shape[:2]
        for row, column in partition_points(height, width, self._settings.lines):
            shown: list[Views] = []
            for rows, columns in covered_halves(row, column):
                masked = {name: picture.copy() for name, picture in views.items()}
                for picture in masked.values():
                    picture[rows, columns] = 0
                shown.append(masked)
            yield shown

    def _predict_many(self, samples: list[Views]) -> Sequence[Sequence[Detection]]:
        if isinstance(self._model, BatchPredictor):
            return self._model.predict_many(samples)
        return [self._model.predict(sample) for sample in samples]


@dataclasses.dataclass(frozen=True, slots=True)
class ObjectSeeker:
    """The defense ObjectSeeker: pictures pass unchanged, and the detector is called on masked pictures, too.

    Attributes:
        settings: options of the defense.
    """

    settings: ObjectSeekerConfig

    def fit(
        self, clean: Sequence[Views], patched: Sequence[Views], model: Model | None, rng: np.random.Generator
    ) -> None:
        """Does nothing, because ObjectSeeker needs no calibration.

        Args:
            clean, patched, model, rng: not used.
        """
        return

    def apply(self, views: Views, model: Model | None, state: Any, rng: np.random.Generator) -> DefenseResult:
        """Returns the pictures unchanged.

        Args:
            views: (H, W, 3) uint8 pictures of the sample by camera name.
            model, state, rng: not used.
        """
        return DefenseResult(views=dict(views))

    def forward(self, views: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the pictures unchanged; the wrapped model's losses contain the masked pictures.

        Args:
            views: (B, 3, H, W) pictures by camera name, float in 0..1.
        """
        return dict(views)

    def wrap(self, model: Model) -> Model:
        """Returns a detector that also searches masked pictures.

        Args:
            model: the detector to be defended.
        """
        return SeekingModel(model, self.settings)
