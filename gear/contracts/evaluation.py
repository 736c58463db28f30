"""Optional protocols of tasks and evaluators: stored predictions, masked ground truth, further reports, fast intervals.

What a task or an evaluator offers is decided by `isinstance` with these runtime-checkable protocols.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from gear.contracts.tasks import Encoded, Evaluator, SplitInfo
from gear.values.picture_objects import PictureObjects
from gear.values.serial import Json

Masks = Mapping[str, npt.NDArray[np.bool_]]
"""(H, W) bool by camera name."""

Draws = npt.NDArray[np.int64]
"""(R, N) indices of gathered samples: each row chooses N of them, possibly with repetition."""

Spread = Mapping[str, npt.NDArray[np.float64]]
"""(R,) values by metric."""


@runtime_checkable
class KeepsPredictions(Protocol):
    """A task whose predictions are stored as files, in the result layout of its format.

    For a task without this protocol only metrics are stored, and an interrupted evaluation predicts every sample again.
    """

    def encode_prediction(self, sample: Any, prediction: Any, info: SplitInfo) -> Encoded:
        """The result files of one sample, by path relative to the folder of predictions, with facts as JSON."""
        ...

    def decode_prediction(self, root: Path, sample: Any, facts: Json, info: SplitInfo) -> Any:
        """Reads a prediction back: the exact inverse of `encode_prediction`."""
        ...

    def finalise_predictions(self, facts: Sequence[tuple[Any, Json]], info: SplitInfo) -> Mapping[str, bytes]:
        """The result files of a split, such as COCO's list of detections.

        Args:
            facts: scene record and facts of each sample, in order of index.
            info: names and seed of the split.
        """
        ...


@runtime_checkable
class Maskable(Protocol):
    """A task whose ground truth can be removed from a part of the picture, such as the patch."""

    def without(self, sample: Any, masks: Masks) -> Any:
        """The sample without ground truth where the masks are True; its evaluator ignores predictions there.

        Args:
            sample: of the task; not changed.
            masks: (H, W) bool by camera name.
        """
        ...


@runtime_checkable
class WithObjects(Protocol):
    """A task of objects that are found or missed, whose twins can be compared object by object."""

    def picture_objects(self, sample: Any, prediction: Any) -> PictureObjects:
        """The objects of a sample that should be found, and the detections.

        Raises:
            ValueError: a detection cannot be measured.
        """
        ...


@runtime_checkable
class Reports(Protocol):
    """A task with further evaluators, in addition to its main one."""

    def reports(self) -> Mapping[str, Evaluator[Any, Any]]:
        """New, empty evaluators by name. `reference` holds the metrics that the cards of shipped weights state."""
        ...


@runtime_checkable
class Resampled(Protocol):
    """An evaluator that computes its metrics over chosen samples faster than by merging one evaluator for each
    sample.
    """

    def resampled(self, draws: Draws) -> Spread:
        """Metrics by name as if the chosen samples alone had been gathered. Samples are numbered from 0 in the order of
        the calls of `update`.

        NaN where a metric is undefined. Metrics that are missing from the result get no interval.
        """
        ...


@runtime_checkable
class Additive(Protocol):
    """An evaluator whose metrics are functions of sums over pictures, so that merging is addition."""

    def totals(self) -> Mapping[str, npt.NDArray[Any]]:
        """The sums by name; names and shapes are the same for all evaluators of a class."""
        ...

    def metrics(self, totals: Mapping[str, npt.NDArray[Any]]) -> Spread:
        """The metrics of R sets of sums at once.

        Args:
            totals: sums by name, as `totals` gives them, with an additional first axis of length R.

        Returns:
            (R,) values by metric, equal to those of `result`; NaN where a metric is undefined.
        """
        ...


@runtime_checkable
class Limited(Protocol):
    """An evaluator with metrics that stay below 1 for few samples even if all predictions are perfect."""

    def ceilings(self) -> Mapping[str, float]:
        """The metrics that perfect predictions of the gathered samples would reach, for those below 1."""
        ...


@runtime_checkable
class Ranged(Protocol):
    """An evaluator that states the ranges of its metrics; intervals are cut at their ends."""

    def range_of(self, metric: str) -> tuple[float, float]:
        """Smallest and largest possible value of a metric; infinite where it has no bound."""
        ...
