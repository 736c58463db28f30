"""The attack protocol. torch appears in types alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from gear.contracts.models import Model

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Patch:
    """One printed patch.

    Attributes:
        name: `patch_0`, `patch_1`, …, for the surface of the same number.
        rgb: (H, W, 3) float32, sRGB in 0..1.
    """

    name: str
    rgb: npt.NDArray[np.float32]


def surface_of(name: str) -> int:
    """The surface that a patch's name says, by which patches are in order: 10 for `patch_10`; -1 if it says none."""
    number = name.rpartition("_")[2]
    return int(number) if number.isdecimal() else -1


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """What an attack may spend.

    Attributes:
        steps: optimisation steps.
        queries: forward passes, for attacks without gradients.
    """

    steps: int
    queries: int | None = None


class Compositor(Protocol):
    """Puts patches into pictures, differentiably."""

    def compose(self, patches: Sequence[Tensor], samples: Sequence[int], view: str) -> Tensor:
        """(B, 3, H, W) pictures in 0..1 of the samples with the patches on their surfaces.

        A patch is (3, h, w) for all samples, or (B, 3, h, w) with one look for each; values in 0..1.
        """
        ...


State = Mapping[str, npt.NDArray[Any]]
"""What an attack needs to go on where it was cut off: arrays by name."""


class Watch(Protocol):
    """Looks on while an attack works: progress, curves, checkpoints, early stopping."""

    def resume(self) -> State | None:
        """The last state that an earlier run of the same attack left behind; None for a fresh start."""
        ...

    def step(
        self,
        done: int,
        values: Mapping[str, float],
        patches: Callable[[], tuple[Patch, ...]],
        state: Callable[[], State],
    ) -> bool:
        """Told after every step; True asks the attack to end now.

        Args:
            done: steps so far.
            values: what is worth a curve: terms, losses, norms.
            patches: gives the patches as they are now; called only when they are wanted.
            state: gives the state to resume from, likewise; empty where the attack cannot be resumed.
        """
        ...


class Attack(Protocol):
    """Optimises patches against a model.

    Two methods more are used where an attack has them, each of one sample of the data set: `objective(sample)`, a
    `gear.plugins.attacks.optimisation.objectives.Objective` by which patches are judged on validation samples
    (untargeted harm to the task otherwise), and `settings(sample)`, a dataclass with the options as they are used,
    where those depend on the task. A third, `read_sha256()`, is the hash of files that its options name, or
    None: patches that were made from other files are others.
    """

    def optimise(
        self,
        model: Model,
        dataset: Sequence[Any],
        compositor: Compositor,
        *,
        budget: Budget,
        rng: np.random.Generator,
        watch: Watch | None = None,
    ) -> tuple[Patch, ...]:
        """One patch a surface; the model is left as it was.

        An attack that pays `watch` no attention works, but shows no progress and cannot be resumed.
        """
        ...
