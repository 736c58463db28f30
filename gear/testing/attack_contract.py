"""The contract of attacks (what every attack plugin promises), as tests.

Subclass it in your plugin's tests and set `spec`:

    class TestMyAttack(AttackContract):
        spec = my_attack
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor

from gear.contracts.attacks import Attack, Budget, Monitor, Patch, State
from gear.contracts.specs import AttackSpec, ModelSpec, TaskSpec
from gear.plugins.manager import catalogue
from gear.testing.compare import difference, freeze
from gear.testing.model_state import changes, state_of
from gear.testing.spec_checks import check_spec
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import Thing, board, box_part
from gear.testing.tiny_compositor import TinyCompositor
from gear.testing.tiny_networks import TinyConfig, tiny_depth, tiny_segmenter
from gear.values.rng import derive_rng

SEED = 11
TINY: Mapping[str, ModelSpec[TinyConfig]] = {"semseg": tiny_segmenter, "depth": tiny_depth}
ROOM = Thing(parts=(box_part("building", 2.0, 60.0, 14.0),), position_m=(40.0, 0.0, 0.0))


class Counted:
    """A wrapper of a model that counts the forward passes.

    Attributes:
        network: the wrapped model.
        passes: number of calls of `predict` and `forward`.
    """

    def __init__(self, model: Any) -> None:
        """Wraps a model.

        Args:
            model: a torch module with the protocol `Model`.
        """
        self.network = model
        self.passes = 0

    def predict(self, views: Mapping[str, Any]) -> Any:
        """The model's prediction for one sample; the call counts as one pass.

        Args:
            views: pictures of the sample by camera name.
        """
        self.passes += 1
        return self.network.predict(views)

    def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
        """The model's outputs, or losses if `targets` are given, for a batch; the call counts as one pass.

        Args:
            views: (B, 3, H, W) pictures in 0..1 by camera name.
            targets: the batch's samples; None for outputs.
        """
        self.passes += 1
        outputs: Mapping[str, Tensor] = self.network(views, targets)
        return outputs

    def taps(self) -> Mapping[str, torch.nn.Module]:
        """The tapped layers of the model (layers with readable feature maps), by name."""
        taps: Mapping[str, torch.nn.Module] = self.network.taps()
        return taps


class RecordingMonitor:
    """A `Monitor` that records the number and the state of every step, and can start an attack from a saved state.

    Attributes:
        start: state that `resume` returns.
        steps_done: number of steps done, at each call of `step`.
        states: state of the attack at each call of `step`.
    """

    def __init__(self, start: State | None = None) -> None:
        """Makes a monitor without recorded steps.

        Args:
            start: state from which the attack starts; None for a new run.
        """
        self.start = start
        self.steps_done: list[int] = []
        self.states: list[State] = []

    def resume(self) -> State | None:
        """The saved state from which the attack starts; None for a new run."""
        return self.start

    def step(
        self,
        done: int,
        values: Mapping[str, float],
        patches: Callable[[], tuple[Patch, ...]],
        state: Callable[[], State],
    ) -> bool:
        """Records the number of the step and the state, and checks the types of values and patches.

        It returns False, so it never ends the attack.

        Args:
            done: number of steps done.
            values: numbers by name, such as losses.
            patches: function that returns the current patches.
            state: function that returns the state of the attack.
        """
        self.steps_done.append(done)
        self.states.append(state())
        assert all(isinstance(value, float) for value in values.values())
        assert all(isinstance(patch, Patch) for patch in patches())
        return False


class AttackContract:
    """The promises of an attack plugin, as tests. A plugin's test file subclasses it and sets `spec`.

    Attributes:
        spec: the attack's spec.
        options: options of the attack's config, small enough for quick tests.
        task: a task that the attack supports and for which gear has a tiny network: `semseg` or `depth`.
        task_options: options of the task's config, such as the size of the pictures.
        steps: number of steps after which the attack does measurable harm.
        passes_per_step: largest number of forward passes per step.
    """

    spec: ClassVar[AttackSpec[Any]]
    options: ClassVar[Mapping[str, Any]] = {}
    task: ClassVar[str] = "semseg"
    task_options: ClassVar[Mapping[str, Any]] = {"width_px": 96, "height_px": 48}
    steps: ClassVar[int] = 12
    passes_per_step: ClassVar[int] = 4

    def make(self) -> Attack:
        """Builds a new attack from the spec and the options."""
        return self.spec.build(self.spec.config(**self.options))

    def model(self) -> Counted:
        """Builds a tiny network for the task, which counts its forward passes."""
        return Counted(TINY[self.task].build(TinyConfig()))

    def dataset(self, boards: int = 1) -> list[Any]:
        """Makes two read-only samples of a synthetic street with the given number of billboards.

        Args:
            boards: number of billboards, each with one surface.
        """
        found = catalogue().get("task", self.task).spec
        assert isinstance(found, TaskSpec)
        task = found.build(found.config(**self.task_options))
        frames = []
        for index in range(2):
            things = [board(11.0 + index, 9.0 * n, surface=n) for n in range(boards)]
            frames.append(synthetic_frame(task.rig(), [*things, ROOM], index=index))
        return [freeze(task.ground_truth(*frame)) for frame in frames]

    def budget(self, steps: int) -> Budget:
        """A budget of some steps; for attacks without gradients also of `passes_per_step` queries per step.

        Args:
            steps: number of steps.
        """
        return Budget(steps=steps, queries=None if self.spec.needs_gradients else steps * self.passes_per_step)

    def attack(
        self,
        model: Counted,
        dataset: Sequence[Any],
        *,
        steps: int = 2,
        seed: int = SEED,
        monitor: Monitor | None = None,
    ) -> tuple[Patch, ...]:
        """Runs a new attack with `TinyCompositor`, and returns its patches.

        Args:
            model: the attacked model, which counts its calls.
            dataset: samples on which the patches are optimised.
            steps: number of steps.
            seed: seed of the attack.
            monitor: receives the progress of each step; None for no monitor.
        """
        compositor = TinyCompositor(dataset)
        rng = derive_rng(seed, "attack")
        return self.make().optimise(model, dataset, compositor, budget=self.budget(steps), rng=rng, monitor=monitor)

    def harm(self, model: Counted, dataset: Sequence[Any], patches: Sequence[Patch]) -> float:
        """The harm that the attack maximises: the sum of the model's losses. Override it for another objective.

        Args:
            model: the attacked model.
            dataset: the samples.
            patches: patches, one per surface.
        """
        tensors = [torch.from_numpy(patch.rgb.copy()).permute(2, 0, 1) for patch in patches]
        (view,) = TINY[self.task].views
        with torch.no_grad():
            pictures = TinyCompositor(dataset).compose(tensors, range(len(dataset)), view)
            return float(sum(model.forward({view: pictures}, dataset).values()))

    def test_the_spec_can_be_used(self) -> None:
        """Name, protocol, config and build of the spec are valid; the attack supports the task of the test."""
        check_spec("attack", self.spec, self.options)
        assert not self.spec.tasks or self.task in self.spec.tasks
        assert self.spec.max_surfaces >= 1

    def test_patches_are_pictures(self) -> None:
        """There is one patch per surface, named `patch_0`, `patch_1`, …; each is (H, W, 3) float32 in 0..1."""
        for boards in range(1, min(2, self.spec.max_surfaces) + 1):
            patches = self.attack(self.model(), self.dataset(boards))
            assert isinstance(patches, tuple)
            assert [patch.name for patch in patches] == [f"patch_{n}" for n in range(boards)]
            for patch in patches:
                assert patch.rgb.dtype == np.float32 and patch.rgb.ndim == 3 and patch.rgb.shape[2] == 3
                assert np.isfinite(patch.rgb).all(), "a patch has no NaN and no infinity"
                assert 0 <= float(patch.rgb.min()) <= float(patch.rgb.max()) <= 1

    def test_the_model_is_left_as_it_was(self) -> None:
        """The attack restores parameters, buffers, gradients, `requires_grad` and the mode of every module."""
        model = self.model()
        before = state_of(model.network)
        self.attack(model, self.dataset())
        assert changes(before, state_of(model.network)) == []

    def test_the_dataset_is_left_as_it_was(self) -> None:
        """The attack works on read-only samples and does not change them."""
        dataset = self.dataset()
        self.attack(self.model(), dataset)
        assert not difference(dataset, self.dataset(), "dataset")

    def test_it_can_be_watched(self) -> None:
        """A monitor receives steps in order and changes no patch; a saved state resumes the attack exactly."""
        dataset, plain = self.dataset(), self.attack(self.model(), self.dataset(), steps=4)
        monitor = RecordingMonitor()
        found = self.attack(self.model(), dataset, steps=4, monitor=monitor)
        assert not difference(found, plain, "patches")
        assert monitor.steps_done == sorted(set(monitor.steps_done))
        if len(monitor.states) > 1 and monitor.states[0]:
            resumed = self.attack(self.model(), dataset, steps=4, monitor=RecordingMonitor(monitor.states[0]))
            assert not difference(resumed, plain, "patches after a resumed run")

    def test_the_same_generator_gives_the_same_patch(self) -> None:
        """Two runs with equal random generators give equal patches, whatever torch's own generator drew before."""
        first = self.attack(self.model(), self.dataset())
        torch.rand(3)
        second = self.attack(self.model(), self.dataset())
        assert not difference(first, second, "patches")

    def test_it_stays_within_its_budget(self) -> None:
        """The number of forward passes is limited by steps, or by queries for attacks without gradients."""
        for steps in (1, 3):
            model = self.model()
            self.attack(model, self.dataset(), steps=steps)
            least = 0 if self.spec.is_control else 1
            assert least <= model.passes <= steps * self.passes_per_step * (not self.spec.is_control)

    def test_it_does_harm(self) -> None:
        """The patch does more harm than a grey patch of the same size; control patches (not optimised) are exempt."""
        if self.spec.is_control:
            return
        model, dataset = self.model(), self.dataset()
        patches = self.attack(model, dataset, steps=self.steps)
        grey = [Patch(name=patch.name, rgb=np.full_like(patch.rgb, 0.5)) for patch in patches]
        assert self.harm(model, dataset, patches) > self.harm(model, dataset, grey)

    def test_gradients_are_needed_where_declared(self) -> None:
        """An attack that declares that it needs no gradients runs on a model that returns none."""
        if self.spec.needs_gradients:
            return

        class Opaque(Counted):
            def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
                with torch.no_grad():
                    return super().forward(views, targets)

        assert self.attack(Opaque(self.model().network), self.dataset())
