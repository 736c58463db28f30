"""The protocol of attacks, and optional protocols for more. torch is imported for type checkers only."""

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
    """Composes patches into the pictures of samples, differentiably with respect to the patches."""

    def compose(self, patches: Sequence[Tensor], samples: Sequence[int], view: str) -> Tensor:
        """Composes pictures of some samples with the patches on their surfaces.

        Args:
            patches: one per surface, values in 0..1: (3, h, w) for all samples, or (B, 3, h, w) with one per sample.
            samples: indices of B samples in the dataset.
            view: name of the camera.

        Returns:
            (B, 3, H, W) pictures in 0..1.
        """
        ...


State = Mapping[str, npt.NDArray[Any]]
"""Arrays by name, from which an interrupted attack can be resumed."""


class Monitor(Protocol):
    """Observes an attack while it runs, for progress, curves, checkpoints and early stopping."""

    def resume(self) -> State | None:
        """The last state that an interrupted run of the same attack reported; None for a new run."""
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
            done: number of steps done.
            values: scalars by name, such as terms, losses and norms.
            patches: function that returns the current patches; called only if they are needed.
            state: function that returns the state to resume from; an empty mapping where the attack cannot be resumed.

        Returns:
            Whether the attack should stop.
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
        monitor: Monitor | None = None,
    ) -> tuple[Patch, ...]:
        """Optimises one patch for each surface of the samples.

        Args:
            model: attacked network; after the call its weights, buffers and modes are as before.
            dataset: samples of one task, whose pictures show no patch of this attack.
            compositor: puts patches into the samples' pictures.
            budget: steps and queries that may be spent.
            rng: generator of all random choices.
            monitor: called after every step; an attack that ignores it works, but shows no progress and cannot be
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
    """What an attack maximises, as one or several terms."""

    def terms(
        self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indexes: Sequence[int]
    ) -> Mapping[str, Term]:
        """Terms by name; empty where the batch has nothing left that could be harmed.

        Args:
            model: attacked network.
            views: (B, 3, H, W) pictures in 0..1 with the patch in them, by camera name.
            samples: the batch's samples; their own pictures are without the patch.
            indexes: indices of the samples in the dataset, for objectives that cache values per sample.
        """
        ...


@runtime_checkable
class HarmObjective(Protocol):
    """An objective that compares patches by `harm`, because the sum of its weighted terms is not comparable between
    patches.
    """

    @property
    def needs_clean_output(self) -> bool:
        """Whether `harm` needs the model's output on the picture without the patch, once for each sample.

        This output counts among the queries of black-box attacks.
        """
        ...

    def harm(self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indexes: Sequence[int]) -> Tensor:
        """Scalar tensor that grows with the harm to a batch; the arguments are those of `Objective.terms`."""
        ...


@runtime_checkable
class WithObjective(Protocol):
    """An attack that chooses the objective by which its patches are compared on validation samples.

    Patches of other attacks are compared by untargeted harm to the task.
    """

    def objective(self, sample: Any) -> Objective:
        """A new objective for the task of the sample."""
        ...


@runtime_checkable
class WithTaskOptions(Protocol):
    """An attack whose options depend on the task, such as its learning rate."""

    def settings(self, sample: Any) -> Any:
        """Dataclass of the options that are used for the task of the sample; written to `attack.json`."""
        ...


@runtime_checkable
class WithInputFiles(Protocol):
    """An attack whose options name files. Their content is part of what identifies its patches."""

    def read_sha256(self) -> str | None:
        """Hash of the content of these files; None if the options name no file."""
        ...
