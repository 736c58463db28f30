"""The attack protocol, and what an attack may offer beyond it. torch is imported for type checkers alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from gear.contracts.models import Model

if TYPE_CHECKING:
    from torch import Tensor


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Patch:
    """One optimised patch.

    Attributes:
        name: `patch_0`, `patch_1`, …; the number is that of its surface.
        rgb: (H, W, 3) float32, sRGB in 0..1.
    """

    name: str
    rgb: npt.NDArray[np.float32]


def surface_of(name: str) -> int:
    """The number of the surface in a patch's name: 10 for `patch_10`; -1 where the name has no number. Patches are
    sorted by it.
    """
    number = name.rpartition("_")[2]
    return int(number) if number.isdecimal() else -1


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """What an attack may spend.

    Attributes:
        steps: optimisation steps.
        queries: forward passes of black-box attacks; None for no limit.
    """

    steps: int
    queries: int | None = None


class Compositor(Protocol):
    """Puts patches into the pictures of samples, differentiably with respect to the patches."""

    def compose(self, patches: Sequence[Tensor], samples: Sequence[int], view: str) -> Tensor:
        """Pictures of some samples with the patches on their surfaces.

        Args:
            patches: one for each surface, values in 0..1: (3, h, w), or (B, 3, h, w) with another appearance for each
                sample.
            samples: B numbers of samples in the dataset.
            view: name of the camera.

        Returns:
            (B, 3, H, W) pictures in 0..1.
        """
        ...


State = Mapping[str, npt.NDArray[Any]]
"""Arrays by name from which an interrupted attack resumes."""


class Watch(Protocol):
    """Observes an attack while it works, for progress, curves, checkpoints and early stopping."""

    def resume(self) -> State | None:
        """The last state that an interrupted run of the same attack reported; None for a fresh start."""
        ...

    def step(
        self,
        done: int,
        values: Mapping[str, float],
        patches: Callable[[], tuple[Patch, ...]],
        state: Callable[[], State],
    ) -> bool:
        """Called after every step.

        Args:
            done: steps so far.
            values: scalars for curves, by name: terms, losses, norms.
            patches: returns the current patches; called when they are needed.
            state: returns the state to resume from; an empty mapping where the attack cannot be resumed.

        Returns:
            Whether the attack should stop now.
        """
        ...


class Attack(Protocol):
    """Optimises patches against a model. `WithObjective`, `WithTaskOptions` and `WithInputFiles` are optional."""

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
        """Optimises one patch for each surface of the samples.

        Args:
            model: attacked network; after the call its weights, buffers and modes are as before.
            dataset: samples of one task, whose pictures show no patch of this attack.
            compositor: puts patches into the samples' pictures.
            budget: steps and queries that may be spent.
            rng: of all random choices.
            watch: called after every step; an attack that ignores it works, but shows no progress and cannot be
                resumed.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Term:
    """One summand of an objective.

    Attributes:
        value: scalar tensor, differentiable, that grows with the harm.
        weight: factor of its gradient, after that has been brought to unit length.
    """

    value: Tensor
    weight: float = 1.0


class Objective(Protocol):
    """What an attack maximises: terms of a batch."""

    def terms(
        self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indexes: Sequence[int]
    ) -> Mapping[str, Term]:
        """Terms by name; empty where the batch has nothing left that could be harmed.

        Args:
            model: attacked network.
            views: (B, 3, H, W) pictures in 0..1 with the patch in them, by camera name.
            samples: the batch's samples, whose own pictures are without the patch.
            indexes: numbers of the samples in the dataset, by which an objective may remember things.
        """
        ...


@runtime_checkable
class HarmObjective(Protocol):
    """An objective whose weighted terms do not add up to a number by which patches can be compared."""

    @property
    def asks_for_clean(self) -> bool:
        """Whether `harm` needs the model's answer to the picture without the patch, once for each sample.

        Attacks whose queries are counted pay for that answer.
        """
        ...

    def harm(self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indexes: Sequence[int]) -> Tensor:
        """Scalar tensor that grows with the harm of a batch; arguments as of `Objective.terms`."""
        ...


@runtime_checkable
class WithObjective(Protocol):
    """An attack that says by which objective its patches are judged on validation samples.

    Patches of other attacks are judged by untargeted harm to the task.
    """

    def objective(self, sample: Any) -> Objective:
        """A fresh objective for the task that the sample is of."""
        ...


@runtime_checkable
class WithTaskOptions(Protocol):
    """An attack whose options depend on the task, such as a learning rate that is chosen for it."""

    def settings(self, sample: Any) -> Any:
        """Dataclass of the options that are used for the task that the sample is of; noted in `attack.json`."""
        ...


@runtime_checkable
class WithInputFiles(Protocol):
    """An attack whose options name files: patches that were made from other files are other patches."""

    def read_sha256(self) -> str | None:
        """Hash of the content of these files; None where the options name none."""
        ...
