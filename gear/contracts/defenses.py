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
    """Guards a model. A defense holds no state between calls; what it learns is what `fit` returns."""

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
            patched: the same scenes with a patch; empty where the user gave none.
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
        """The cleaning in torch, for attacks that take the defense into account.

        Takes and returns (B, 3, H, W) float pictures in 0..1 by camera name. Values are those of `apply` up to
        rounding. The gradient is exact where the spec declares `differentiable`, a declared substitute where it
        declares `surrogate`.

        Raises:
            ValueError: the spec declares `none`, or the defense is `Taught`.
        """
        ...

    def wrap(self, model: Model) -> Model:
        """A model that runs the given one inside, for defenses of several passes; other defenses return the model
        itself.
        """
        ...


@runtime_checkable
class Taught(Protocol):
    """A defense whose cleaning in torch depends on the model, or on what `fit` learnt."""

    def forward_taught(self, views: Mapping[str, Tensor], model: Model, state: Any) -> Mapping[str, Tensor]:
        """As `Defense.forward`; attacks call this method of a `Taught` defense in its place.

        Args:
            views: (B, 3, H, W) float pictures in 0..1 by camera name.
            model: the guarded model; its parameters need no gradient.
            state: what `fit` returned for this model.
        """
        ...


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DefendedBatch:
    """What a defense makes of a batch, with gradients to the pictures.

    Attributes:
        views: (B, 3, H, W) cleaned pictures in 0..1 by camera name.
        masks: (B, H, W) where the patch is believed to be, in 0..1 by camera name, before any rounding; None for none.
        scores: (B,) how sure the defense is of an attack, in 0..1; None for none.
    """

    views: Mapping[str, Tensor]
    masks: Mapping[str, Tensor] | None = None
    scores: Tensor | None = None


@runtime_checkable
class Detecting(Protocol):
    """A defense whose score or mask an adaptive attack can lower.

    A defense that only scores must have this: nothing else of it has a gradient for an attack.
    """

    def defend_batch(self, views: Mapping[str, Tensor], model: Model, state: Any) -> DefendedBatch:
        """Pictures, masks and scores of a batch; attacks call neither `forward` nor `forward_taught` beside it.

        Args:
            views: (B, 3, H, W) float pictures in 0..1 by camera name.
            model: that is guarded; its parameters may need no gradient.
            state: what `fit` returned for this model.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class FitReport:
    """What a defense learnt, measured on its own calibration data.

    Attributes:
        values: numbers by name, such as the loss of what was learnt and that of the constant answer.
        problems: one line for each reason not to trust what was learnt; shown as loudly as an error.
    """

    values: Mapping[str, float]
    problems: tuple[str, ...] = ()


@runtime_checkable
class Reporting(Protocol):
    """What `fit` returns, if it says what was learnt."""

    def fit_report(self) -> FitReport:
        """How well the defense knows its own calibration data."""
        ...
