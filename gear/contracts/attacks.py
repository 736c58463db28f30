"""The protocol of attacks, and optional protocols for attacks with further abilities. torch is imported for type
checkers only.
"""

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
    """The number of the surface that a patch belongs to, from the patch's name. Patches are sorted by this number.

    Args:
        name: name of the patch, such as `patch_10`.

    Returns:
        The number, such as 10; -1 for a name without number.
    """
    number = name.rpartition("_")[2]
    return int(number) if number.isdecimal() else -1


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """The computation that an attack may use.

    Attributes:
        steps: optimisation steps.
        queries: forward passes of black-box attacks; None for no limit.
    """

    steps: int
    queries: int | None = None


class Compositor(Protocol):
    """Renders patches into the pictures of samples; the pictures are differentiable with respect to the patches."""

    def compose(self, patches: Sequence[Tensor], samples: Sequence[int], view: str) -> Tensor:
        """Composes the pictures of some samples with the patches on their surfaces.

        Args:
            patches: one tensor per surface, values in 0..1: (3, h, w) for all samples, or (B, 3, h, w) with one patch
                per sample.
            samples: indices of B samples in the dataset.
            view: name of the camera.

        Returns:
            (B, 3, H, W) pictures in 0..1.
        """
        ...


State = Mapping[str, npt.NDArray[Any]]
"""State of an attack as arrays by name, from which an interrupted attack can be resumed."""


class Monitor(Protocol):
    """Observes a running attack: it shows progress, records curves, writes checkpoints and decides on early
    stopping.
    """

    def resume(self) -> State | None:
        """The last state that an interrupted run of this attack reported; None for a new run."""
        ...

    def step(
        self,
        done: int,
        values: Mapping[str, float],
        patches: Callable[[], tuple[Patch, ...]],
        state: Callable[[], State],
    ) -> bool:
        """Is called by the attack after every step.

        Args:
            done: number of steps done.
            values: scalars by name, such as terms and norms. Figures say that up is better for the attack, except for
                `gradient`, `queries_left`, `smoothness` and `printability`.
            patches: function that returns the current patches; the monitor calls it only if it needs them.
            state: function that returns the state to resume from; an empty mapping where the attack cannot be resumed.

        Returns:
            Whether the attack should stop.
        """
        ...


class Attack(Protocol):
    """Optimises patches against a model. An attack may also implement `WithObjective`, `WithTaskOptions` and
    `WithInputFiles`.
    """

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
        """Optimises the patches of all surfaces of the samples; returns one patch for each surface.

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
    """One summand of an attack's objective.

    Attributes:
        value: scalar tensor, differentiable, that grows with the harm.
        weight: factor of the term's gradient; the gradient is normalised to unit length first.
    """

    value: Tensor
    weight: float = 1.0


class Objective(Protocol):
    """The quantity that an attack maximises, as one or several terms."""

    def terms(
        self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indices: Sequence[int]
    ) -> Mapping[str, Term]:
        """Computes the terms of the objective for a batch, by name; the result is empty if nothing in the batch
        can still be harmed.

        Args:
            model: attacked network.
            views: (B, 3, H, W) pictures in 0..1 with the patch in them, by camera name.
            samples: the batch's samples; their own pictures are without the patch.
            indices: indices of the samples in the dataset, for objectives that cache values per sample.
        """
        ...


@runtime_checkable
class HarmObjective(Protocol):
    """An objective that compares patches by the scalar `harm`, because the sum of its weighted terms is not
    comparable between patches.
    """

    @property
    def needs_clean_output(self) -> bool:
        """Whether `harm` needs the model's output on the picture without the patch; it is computed once for each
        sample.

        This computation counts among the queries of black-box attacks.
        """
        ...

    def harm(self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indices: Sequence[int]) -> Tensor:
        """A scalar tensor that grows with the harm of the patch to a batch.

        Args:
            model: the attacked network.
            views: (B, 3, H, W) pictures with the patches by camera name, float in 0..1.
            samples: the B samples with their ground truth.
            indices: indices of these samples in the dataset.
        """
        ...


@runtime_checkable
class WithObjective(Protocol):
    """An attack that chooses the objective by which its patches are compared on validation samples.

    Patches of attacks without this protocol are compared by untargeted harm to the task.
    """

    def objective(self, sample: Any) -> Objective:
        """A new objective for the task to which the sample belongs.

        Args:
            sample: a sample of the task.
        """
        ...


@runtime_checkable
class SampleWithObjective(Protocol):
    """A sample that brings its own objective, such as a drive in the closed loop; attacks without gradients maximise
    it in place of the objective of a task.
    """

    def own_objective(self) -> Objective:
        """The objective of all attacks on this sample."""
        ...


@runtime_checkable
class WithTaskOptions(Protocol):
    """An attack whose options depend on the task, such as its learning rate."""

    def settings(self, sample: Any) -> Any:
        """The options that the attack uses for the task of the sample, as a dataclass; they are written to
        `attack.json`.

        Args:
            sample: a sample of the task.
        """
        ...


@runtime_checkable
class WithInputFiles(Protocol):
    """An attack whose options name files. The content of these files is part of the identity of its patches."""

    def read_sha256(self) -> str | None:
        """SHA-256 hash of the content of the files that the options name; None if the options name no file."""
        ...
