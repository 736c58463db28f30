"""What a task may offer beyond `Task`, so that evaluations of it can be taken up again, masked and reported on.

Each protocol is optional and looked for by its methods; gear's own tasks come in by the same door as everybody's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from gear.contracts.tasks import Encoded, Evaluator, SplitInfo
from gear.values.serial import Json

Masks = Mapping[str, npt.NDArray[np.bool_]]
"""(H, W) by camera name."""

Draws = npt.NDArray[np.int64]
"""(R, N) numbers of gathered samples: each row chooses N of them, possibly some of them several times."""

Spread = Mapping[str, npt.NDArray[np.float64]]
"""(R,) values by metric."""


@runtime_checkable
class KeepsPredictions(Protocol):
    """A task whose predictions become files, in its format's own result layout.

    Without it an evaluation writes metrics alone, and one that was stopped predicts every sample anew.
    """

    def encode_prediction(self, sample: Any, prediction: Any, info: SplitInfo) -> Encoded:
        """One sample's own result files, relative to the folder of predictions, and facts (JSON)."""
        ...

    def decode_prediction(self, root: Path, sample: Any, facts: Json, info: SplitInfo) -> Any:
        """The inverse of `encode_prediction`, to the last bit."""
        ...

    def finalise_predictions(self, facts: Sequence[tuple[Any, Json]], info: SplitInfo) -> Mapping[str, bytes]:
        """The split's result files, from each sample's record and facts, in order of index."""
        ...


@runtime_checkable
class Maskable(Protocol):
    """A task whose ground truth can be made silent in a part of the picture."""

    def without(self, sample: Any, masks: Masks) -> Any:
        """The sample, whose ground truth says nothing where the masks of its cameras are true.

        The evaluator then ignores what is predicted there.
        """
        ...


@runtime_checkable
class Reports(Protocol):
    """A task with further metrics beside its evaluator."""

    def reports(self) -> Mapping[str, Evaluator[Any, Any]]:
        """Fresh ones by name; `reference` is what a shipped network is held to."""
        ...


@runtime_checkable
class Resampled(Protocol):
    """An evaluator that has a quicker way to its metrics over chosen samples than merging one evaluator each."""

    def resampled(self, draws: Draws) -> Spread:
        """Metrics as if the chosen samples had been gathered, numbered in order of `update` from 0; NaN where nothing
        counts.

        May leave metrics out: these get no interval.
        """
        ...


@runtime_checkable
class Additive(Protocol):
    """An evaluator whose metrics follow from sums over pictures: merging is adding."""

    def totals(self) -> Mapping[str, npt.NDArray[Any]]:
        """The sums, by names and with shapes that are always the same."""
        ...

    def metrics(self, totals: Mapping[str, npt.NDArray[Any]]) -> Spread:
        """What `result` would say of sums with an axis of length R in front: (R,) each, NaN where nothing counts."""
        ...


@runtime_checkable
class Limited(Protocol):
    """An evaluator some of whose metrics stay below 1 on few samples, however good the predictions are."""

    def ceilings(self) -> Mapping[str, float]:
        """What perfect predictions of everything gathered would come to, for the metrics where that is less than 1."""
        ...


@runtime_checkable
class Ranged(Protocol):
    """An evaluator that says between which values its metrics lie, so that intervals end there."""

    def range_of(self, metric: str) -> tuple[float, float]:
        """Least and largest value that a metric can have; infinite where there is no such end."""
        ...
