"""The defense protocol."""

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
    """What a defense makes of one sample.

    Attributes:
        views: cleaned pictures by camera name, shapes and dtypes as they came.
        mask: where the patch is believed to be, by camera name, (H, W) float32 in 0..1, or None.
        score: how sure the defense is that there is an attack, in 0..1, or None.
    """

    views: Mapping[str, UInt8Image]
    mask: Mapping[str, npt.NDArray[np.float32]] | None = None
    score: float | None = None


class Defense(Protocol):
    """Guards a model. Holds no state between calls but what `fit` returns."""

    def fit(
        self,
        clean: Sequence[Mapping[str, UInt8Image]],
        patched: Sequence[Mapping[str, UInt8Image]],
        model: Model | None,
        rng: np.random.Generator,
    ) -> Any:
        """Calibrates on samples; returns the state for `apply`, None where there is nothing to learn."""
        ...

    def apply(
        self, views: Mapping[str, UInt8Image], model: Model | None, state: Any, rng: np.random.Generator
    ) -> DefenseResult:
        """Cleans one sample; never writes to its input."""
        ...

    def forward(self, views: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """The cleaning in torch, for attacks that know of the defense.

        (B, 3, H, W) float pictures in 0..1 to the same. Its values are those of `apply` up to rounding; its gradient is
        exact where the spec says `differentiable`, a stand-in where it says `surrogate`.

        Raises:
            ValueError: the spec says `none`, or the defense is `Taught`.
        """
        ...

    def wrap(self, model: Model) -> Model:
        """The model inside the defense, for defenses of several passes; others return it as it is."""
        ...


@runtime_checkable
class Taught(Protocol):
    """A defense whose cleaning in torch needs the model, or what `fit` made of it."""

    def forward_taught(self, views: Mapping[str, Tensor], model: Model, state: Any) -> Mapping[str, Tensor]:
        """As `Defense.forward`, which attacks do not call where there is this.

        Args:
            views: (B, 3, H, W) float pictures in 0..1 by camera name.
            model: that is guarded; its parameters may need no gradient.
            state: what `fit` returned for this model.
        """
        ...
