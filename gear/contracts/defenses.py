"""The defense protocol: a defense cleans pictures, detects patches, or both, in front of a model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from gear.contracts.models import Model
from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DefenseResult:
    """What a defense returns for one sample.

    Attributes:
        views: cleaned (H, W, 3) uint8 pictures by camera name, of the shapes that came in.
        mask: (H, W) float32 probabilities in 0..1 that a pixel belongs to a patch, by camera name; None where the
            defense finds no patches.
        score: confidence in 0..1 that the sample is attacked; None where the defense gives none.
    """

    views: Mapping[str, UInt8Image]
    mask: Mapping[str, npt.NDArray[np.float32]] | None = None
    score: float | None = None


class Defense(Protocol):
    """Guards a model. A defense object holds no state between calls: what it learns is returned by `fit`."""

    def fit(
        self,
        clean: Sequence[Mapping[str, UInt8Image]],
        patched: Sequence[Mapping[str, UInt8Image]],
        model: Model | None,
        rng: np.random.Generator,
    ) -> Any:
        """Learns from calibration samples.

        Args:
            clean: samples without a patch, (H, W, 3) uint8 pictures by camera name.
            patched: the same scenes with a patch; empty if the user gave none.
            model: the guarded model; None where the spec needs none.
            rng: of all random choices.

        Returns:
            The state that `apply` receives; None where there is nothing to learn.
        """
        ...

    def apply(
        self, views: Mapping[str, UInt8Image], model: Model | None, state: Any, rng: np.random.Generator
    ) -> DefenseResult:
        """Cleans one sample.

        Args:
            views: (H, W, 3) uint8 pictures by camera name; never written to.
            model: the guarded model; None where the spec needs none.
            state: what `fit` returned.
            rng: of all random choices.
        """
        ...

    def forward(self, views: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """The cleaning as torch operations, for attacks that take the defense into account.

        Takes and returns (B, 3, H, W) float pictures in 0..1 by camera name. Values are those of `apply` up to
        rounding. The gradient is exact if the spec declares `differentiable`, and that of a substitute function if it
        declares `surrogate`.

        Raises:
            ValueError: the spec declares `none`, or the defense is a `FittedDefense`.
        """
        ...

    def wrap(self, model: Model) -> Model:
        """A model that contains the given one, for defenses that need several passes; other defenses return the model
        itself.
        """
        ...


@runtime_checkable
class FittedDefense(Protocol):
    """A defense whose cleaning in torch depends on the model, or on the state that `fit` returned."""

    def forward_fitted(self, views: Mapping[str, Tensor], model: Model, state: Any) -> Mapping[str, Tensor]:
        """The counterpart of `Defense.forward`; attacks call this method instead.

        Args:
            views: (B, 3, H, W) float pictures in 0..1 by camera name.
            model: the guarded model; its parameters need no gradient.
            state: what `fit` returned for this model.
        """
        ...


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DefendedBatch:
    """The result of a defense for a batch, with gradients with respect to the pictures.

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
    """A defense whose score or mask has a gradient, so that an adaptive attack can lower it.

    A defense that returns only a score must implement this, because otherwise it has no gradient for an attack.
    """

    def defend_batch(self, views: Mapping[str, Tensor], model: Model, state: Any) -> DefendedBatch:
        """Cleaned pictures, masks and scores of a batch. Attacks call it instead of `forward` and `forward_fitted`.

        Args:
            views: (B, 3, H, W) float pictures in 0..1 by camera name.
            model: the guarded model; its parameters may need no gradient.
            state: what `fit` returned for this model.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class FitReport:
    """A summary of what a defense learnt, measured on its own calibration data.

    Attributes:
        values: numbers by name, such as the loss of the fitted function and that of the best constant.
        problems: one line for each reason not to trust the fit; shown as prominently as an error.
    """

    values: Mapping[str, float]
    problems: tuple[str, ...] = ()


@runtime_checkable
class ReportsFit(Protocol):
    """A state, returned by `fit`, that can summarise what was learnt."""

    def fit_report(self) -> FitReport:
        """The summary, measured on the calibration data."""
        ...
