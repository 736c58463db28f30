"""The protocol of defenses: in front of a model, a defense cleans pictures, detects patches, or both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from gear.contracts.models import Model
from gear.values.frames import UInt8Image
from gear.values.progress import NO_CALLBACKS, PhaseProgress

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DefenseResult:
    """The result of a defense for one sample.

    Attributes:
        views: cleaned (H, W, 3) uint8 pictures by camera name, with the shapes of the input pictures.
        mask: (H, W) float32 probabilities in 0..1 that a pixel belongs to a patch, by camera name; None if the defense
            locates no patches.
        score: confidence in 0..1 that the sample is attacked; None if the defense computes none.
    """

    views: Mapping[str, UInt8Image]
    mask: Mapping[str, npt.NDArray[np.float32]] | None = None
    score: float | None = None


class Defense(Protocol):
    """Protects a model against patches. A defense object holds no state between calls: `fit` returns the
    calibrated state, and `apply` receives it.
    """

    def fit(
        self,
        clean: Sequence[Mapping[str, UInt8Image]],
        patched: Sequence[Mapping[str, UInt8Image]],
        model: Model | None,
        rng: np.random.Generator,
    ) -> Any:
        """Calibrates the defense on samples, and returns its state.

        Args:
            clean: samples without a patch, (H, W, 3) uint8 pictures by camera name.
            patched: the same scenes with a patch; empty if the user gave none.
            model: the protected model; None if the spec needs none.
            rng: generator of all random choices.

        Returns:
            The state that `apply` receives; None if there is nothing to calibrate.
        """
        ...

    def apply(
        self, views: Mapping[str, UInt8Image], model: Model | None, state: Any, rng: np.random.Generator
    ) -> DefenseResult:
        """Cleans the pictures of one sample, or detects patches in them.

        Args:
            views: (H, W, 3) uint8 pictures by camera name; never changed in place.
            model: the protected model; None if the spec needs none.
            state: the state that `fit` returned.
            rng: generator of all random choices.
        """
        ...

    def forward(self, views: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Cleans a batch with torch operations, for attacks that take the defense into account.

        Values are those of `apply` up to rounding. The gradient is exact if the spec declares `differentiable`, and
        that of a substitute function if the spec declares `surrogate`.

        Args:
            views: (B, 3, H, W) float pictures in 0..1 by camera name.

        Returns:
            The cleaned pictures in the same form.

        Raises:
            ValueError: the spec declares `none`, or the defense is a `FittedDefense`.
        """
        ...

    def wrap(self, model: Model) -> Model:
        """Returns the model to use with the defense. Defenses that need several passes return a model that
        contains the given one; other defenses return the given model.

        Args:
            model: the protected model.
        """
        ...


@runtime_checkable
class FitsInPhases(Protocol):
    """A defense that reports the progress of its calibration, which takes long or has several phases."""

    def fit(
        self,
        clean: Sequence[Mapping[str, UInt8Image]],
        patched: Sequence[Mapping[str, UInt8Image]],
        model: Model | None,
        rng: np.random.Generator,
    ) -> Any:
        """Calls `fit_in_phases` without a callback. Defenses with this class as their base inherit this method.

        Args:
            clean, patched, model, rng: as in `fit_in_phases`.
        """
        return self.fit_in_phases(clean, patched, model, rng, NO_CALLBACKS.on_fit_phase)

    def fit_in_phases(
        self,
        clean: Sequence[Mapping[str, UInt8Image]],
        patched: Sequence[Mapping[str, UInt8Image]],
        model: Model | None,
        rng: np.random.Generator,
        on_phase: PhaseProgress,
    ) -> Any:
        """Calibrates the defense as `Defense.fit` does, and returns the same state. It is called instead of `fit`.

        Args:
            clean: samples without a patch, (H, W, 3) uint8 pictures by camera name.
            patched: the same scenes with a patch; empty if the user gave none.
            model: the protected model; None if the spec needs none.
            rng: generator of all random choices.
            on_phase: called after each step with the unit of the current phase, in the singular (`training step`), and
                the numbers of finished and of all steps of this phase.
        """
        ...


@runtime_checkable
class FittedDefense(Protocol):
    """A defense whose cleaning in torch depends on the model, or on the state that `fit` returned."""

    def forward_fitted(self, views: Mapping[str, Tensor], model: Model, state: Any) -> Mapping[str, Tensor]:
        """Cleans a batch with torch operations, given the model and the state. Attacks call this method instead of
        `Defense.forward`.

        Args:
            views: (B, 3, H, W) float pictures in 0..1 by camera name.
            model: the protected model; its parameters need no gradient.
            state: what `fit` returned for this model.
        """
        ...


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DefendedBatch:
    """The result of a defense for a batch; all tensors are differentiable with respect to the input pictures.

    Attributes:
        views: (B, 3, H, W) cleaned pictures in 0..1 by camera name.
        masks: (B, H, W) probabilities in 0..1 that a pixel belongs to a patch, not rounded, by camera name; None
            without a mask.
        scores: (B,) confidences in 0..1 that a sample is attacked; None without a score.
    """

    views: Mapping[str, Tensor]
    masks: Mapping[str, Tensor] | None = None
    scores: Tensor | None = None


@runtime_checkable
class DifferentiableDetector(Protocol):
    """A defense whose score or mask has a gradient, so an adaptive attack can lower it.

    A defense that returns only a score must implement this protocol, because otherwise an attack has no gradient.
    """

    def defend_batch(self, views: Mapping[str, Tensor], model: Model, state: Any) -> DefendedBatch:
        """Computes cleaned pictures, masks and scores of a batch. Attacks call this method instead of `forward`
        and `forward_fitted`.

        Args:
            views: (B, 3, H, W) float pictures in 0..1 by camera name.
            model: the protected model; its parameters may need no gradient.
            state: what `fit` returned for this model.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class FitReport:
    """A summary of the calibration of a defense, measured on its own calibration data.

    Attributes:
        values: numbers by name, such as the loss of the calibrated function and that of the best constant.
        problems: one line for each reason not to trust the calibration; shown as prominently as an error.
    """

    values: Mapping[str, float]
    problems: tuple[str, ...] = ()


@runtime_checkable
class ReportsFit(Protocol):
    """A state, returned by a defense's `fit`, that can summarise its calibration."""

    def fit_report(self) -> FitReport:
        """The summary of the defense's calibration, measured on its calibration data."""
        ...
