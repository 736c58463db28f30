"""Optional protocols of tasks and evaluators: stored predictions, masked ground truth, further reports, fast
intervals, directions of metrics.

gear tests with `isinstance` which of these runtime-checkable protocols a task or an evaluator implements.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from gear.contracts.tasks import Encoded, Evaluator, SplitInfo
from gear.values.frames import UInt8Image
from gear.values.picture_objects import PictureObjects
from gear.values.serial import Json

Masks = Mapping[str, npt.NDArray[np.bool_]]
"""Masks of pixels by camera name: (H, W) bool."""

Draws = npt.NDArray[np.int64]
"""The samples of R resampled datasets: (R, N) indices of gathered samples, from 0. Row r lists the N samples of dataset
r, for example all samples except those of one street (jackknife). A sample may occur several times in a row.
"""

Spread = Mapping[str, npt.NDArray[np.float64]]
"""The values of metrics on R resampled datasets: (R,) by name of the metric."""


@runtime_checkable
class KeepsPredictions(Protocol):
    """A task whose predictions are stored as files, in the result layout of its format.

    For a task without this protocol only metrics are stored, and an interrupted evaluation predicts every sample again.
    """

    def encode_prediction(self, sample: Any, prediction: Any, info: SplitInfo) -> Encoded:
        """Converts the prediction of one sample to result files.

        Args:
            sample: the sample.
            prediction: its prediction in the task's form.
            info: names of the split, town, scene and patch.

        Returns:
            The files, by path relative to the folder of predictions, with JSON data (`facts`) that decoding needs.
        """
        ...

    def decode_prediction(self, root: Path, sample: Any, facts: Json, info: SplitInfo) -> Any:
        """Reads a stored prediction from the folder `root`: the exact inverse of `encode_prediction`.

        Args:
            root: folder of the stored predictions.
            sample: the sample.
            facts: metadata that `encode_prediction` returned.
            info: names of the split, town, scene and patch.
        """
        ...

    def finalise_predictions(self, facts: Sequence[tuple[Any, Json]], info: SplitInfo) -> Mapping[str, bytes]:
        """The result files of a whole split, such as COCO's list of detections, as bytes by path.

        Args:
            facts: scene record and encoded JSON data of each sample, in order of index.
            info: names and seed of the split.
        """
        ...


@runtime_checkable
class DrawsPredictions(Protocol):
    """A task that draws predictions as pictures to look at.

    For a task without this protocol that implements `WithObjects`, gear draws the boxes of objects and detections.
    """

    def prediction_preview(self, sample: Any, prediction: Any) -> Mapping[str, UInt8Image]:
        """Pictures of a prediction by name, (H, W, 3) uint8 RGB.

        A picture has the name and the colours of the picture in `Task.preview` that shows the same for the ground
        truth, so the two can be compared and have the same legend.

        Args:
            sample: the sample.
            prediction: its prediction in the task's form.
        """
        ...


@runtime_checkable
class Maskable(Protocol):
    """A task that can remove ground truth from a part of the picture, such as the patch."""

    def without(self, sample: Any, masks: Masks) -> Any:
        """The sample without ground truth where the masks are True; the task's evaluator ignores predictions
        there.

        Args:
            sample: a sample of the task; it is not changed.
            masks: (H, W) bool by camera name.
        """
        ...


@runtime_checkable
class WithObjects(Protocol):
    """A task of objects that are detected or missed. Its twins (the same dataset with another patch) can be
    compared object by object.
    """

    def picture_objects(self, sample: Any, prediction: Any) -> PictureObjects:
        """The objects of a sample that a detector should find, and the network's detections.

        Args:
            sample: the sample with its ground truth.
            prediction: its prediction in the task's form.

        Raises:
            ValueError: a detection cannot be evaluated.
        """
        ...


@runtime_checkable
class Reports(Protocol):
    """A task with evaluators in addition to its main evaluator; users choose them by `gear evaluate --report NAME`."""

    def reports(self) -> Mapping[str, Evaluator[Any, Any]]:
        """New, empty evaluators by name. `reference` is the evaluator whose metrics the cards of the shipped
        weights state.
        """
        ...


@runtime_checkable
class Resampled(Protocol):
    """An evaluator that computes its metrics on resampled datasets faster than by merging one evaluator for each
    sample.
    """

    def resampled(self, draws: Draws) -> Spread:
        """The metrics on R resampled datasets, from which confidence intervals are computed.

        Args:
            draws: (R, N) sample indices; row r lists the samples of dataset r. Samples are numbered from 0 in the order
                of the calls of `update`.

        Returns:
            (R,) values by name of the metric; NaN where a metric is undefined. Metrics that are missing get no
            interval.
        """
        ...


@runtime_checkable
class Additive(Protocol):
    """An evaluator whose metrics are functions of sums over pictures; two evaluators are merged by adding their
    sums.
    """

    def totals(self) -> Mapping[str, npt.NDArray[Any]]:
        """The sums over pictures by name; names and shapes are the same for all evaluators of a class."""
        ...

    def metrics(self, totals: Mapping[str, npt.NDArray[Any]]) -> Spread:
        """Computes the metrics from R sets of sums at once.

        Args:
            totals: sums by name, as `totals` gives them, with an additional first axis of length R.

        Returns:
            (R,) values by metric, equal to those of `result`; NaN where a metric is undefined.
        """
        ...


@runtime_checkable
class Limited(Protocol):
    """An evaluator with metrics that stay below 1 on few samples, even if all predictions are perfect."""

    def ceilings(self) -> Mapping[str, float]:
        """The values that perfect predictions of the gathered samples would reach, by name of the metric; only
        metrics whose value would be below 1.
        """
        ...


@runtime_checkable
class Ranged(Protocol):
    """An evaluator that states the ranges of its metrics; confidence intervals are cut at the ends of the range."""

    def range_of(self, metric: str) -> tuple[float, float]:
        """Smallest and largest possible value of a metric; infinite on a side without bound.

        Args:
            metric: name of the metric, as in `result`.
        """
        ...


@runtime_checkable
class Counting(Protocol):
    """An evaluator with metrics that are numbers of events per picture, such as false alarms; if no event occurs, the
    interval of such a metric is that of a Poisson mean.
    """

    def counted(self) -> frozenset[str]:
        """The names of the metrics that are numbers of events per picture. If `Ranged` states their range, it is 0
        to infinity.
        """
        ...


@runtime_checkable
class Directed(Protocol):
    """An evaluator that states for each of its metrics which direction is better; logs and figures show it.

    Without this protocol, the direction of the main metric alone is known, from the spec.
    """

    def lower_is_better(self, metric: str) -> bool | None:
        """Whether lower values of a metric are better; None for a metric without a better direction, such as a number
        of objects, or a signed error, of which 0 is the best value.

        Args:
            metric: name of the metric, as in `result`.
        """
        ...
