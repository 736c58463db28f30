"""Batches, resuming, and what has no gradient."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor

from gear.contracts.attacks import Budget, Patch, State, Term
from gear.plugins.attacks.optimisation.appearance import vary
from gear.plugins.attacks.optimisation.loop import (
    ARRAYS,
    Direction,
    PatchedBatch,
    Problem,
    TextureOptimiser,
    batch_of,
    one_gradient,
    optimise_textures,
    unit_gradients,
)
from gear.plugins.attacks.optimisation.objectives import SemsegObjective, train_labels
from gear.plugins.attacks.optimisation.regularisers import smoothness
from gear.plugins.attacks.optimisation.settings import Appearance, Settings, TextureSettings
from gear.plugins.attacks.scene_specific import scene_specific
from gear.testing.attack_contract import AttackContract
from gear.testing.compare import difference
from gear.testing.tiny_compositor import TinyCompositor
from gear.values.errors import FieldError, GearError
from gear.values.rng import derive_rng

SETTINGS = Settings(height_px=12, width_px=24, batch=1)


class Contract(AttackContract):
    spec = scene_specific


class RecordingMonitor:
    """Keeps every state; may start from one; may stop early."""

    def __init__(self, start: State | None = None, stop_at: int = 10**9) -> None:
        self.start, self.stop_at = start, stop_at
        self.states: list[State] = []
        self.values: list[Mapping[str, float]] = []

    def resume(self) -> State | None:
        return self.start

    def step(
        self,
        done: int,
        values: Mapping[str, float],
        patches: Callable[[], tuple[Patch, ...]],
        state: Callable[[], State],
    ) -> bool:
        self.states.append(state())
        self.values.append(dict(values))
        assert all(patch.rgb.shape == (12, 24, 3) for patch in patches())
        return done >= self.stop_at


def run(monitor: RecordingMonitor, steps: int = 6) -> tuple[Patch, ...]:
    contract = Contract()
    dataset = contract.dataset()
    problem = Problem(model=contract.model(), dataset=dataset, compositor=TinyCompositor(dataset), settings=SETTINGS)
    ascend = unit_gradients(problem, SemsegObjective(), SETTINGS)
    return optimise_textures(problem, ascend, budget=Budget(steps=steps), rng=derive_rng(3, "attack"), monitor=monitor)


def test_an_epoch_shows_every_sample_once() -> None:
    steps = [batch_of(step, 7, 3, seed=5) for step in range(4)]
    first = steps[0] + steps[1]
    assert len(set(first)) == 6 and set(first) <= set(range(7))
    assert steps[2] + steps[3] != first, "every epoch has an order of its own"
    assert batch_of(0, 2, 8, seed=5) in ([0, 1], [1, 0])


def test_what_was_cut_off_goes_on_as_if_it_had_not_been() -> None:
    whole = RecordingMonitor()
    patches = run(whole)
    cut = RecordingMonitor(stop_at=3)
    run(cut)
    assert len(cut.states) == 3
    resumed = RecordingMonitor(start=cut.states[-1])
    assert not difference(run(resumed), patches, "patches")
    assert not difference(resumed.states[-1], whole.states[-1], "state")
    assert {"wrong", "gradient", "smoothness"} <= set(whole.values[0])


def test_gradients_before_clipping_count() -> None:
    """One sample in three shows the patch: steps that feel nothing may be all that are left."""

    def ascend_at(steps_with_gradient: set[int]) -> Direction:
        count = iter(range(100))

        def ascend(textures: Tensor, batch: PatchedBatch) -> tuple[Tensor, dict[str, float]]:
            has_gradient = next(count) in steps_with_gradient
            return torch.full_like(textures, float(has_gradient)), {"gradient": float(has_gradient)}

        return ascend

    contract = Contract()
    dataset = contract.dataset()
    problem = Problem(model=contract.model(), dataset=dataset, compositor=TinyCompositor(dataset), settings=SETTINGS)
    cut = RecordingMonitor(stop_at=2)
    optimise_textures(problem, ascend_at({0}), budget=Budget(steps=4), rng=derive_rng(3, "attack"), monitor=cut)
    resumed = RecordingMonitor(start=cut.states[-1])
    optimise_textures(problem, ascend_at(set()), budget=Budget(steps=4), rng=derive_rng(3, "attack"), monitor=resumed)
    whole = RecordingMonitor()
    optimise_textures(problem, ascend_at({0}), budget=Budget(steps=4), rng=derive_rng(3, "attack"), monitor=whole)
    assert not difference(resumed.states[-1], whole.states[-1], "state")


@pytest.mark.parametrize("rate", [0.05, (0.02, 0.05, 0.2)])
def test_steps_are_adams_within_the_colour_cube(rate: Any) -> None:
    """Kingma and Ba, ICLR 2015, algorithm 1, upwards."""
    settings = TextureSettings(height_px=4, width_px=8, learning_rate=rate)
    ours = TextureOptimiser(2, settings, derive_rng(0, "textures"), None)
    rng, wanted = derive_rng(0, "ascents"), ours.parameters.double().numpy()
    first, second = np.zeros_like(wanted), np.zeros_like(wanted)
    for step, share in enumerate((1.0, 0.7, 0.4, 0.1), start=1):
        ascent = rng.normal(size=wanted.shape).astype(np.float32)
        ours.step(torch.from_numpy(ascent), share)
        first, second = 0.9 * first + 0.1 * ascent, 0.999 * second + 0.001 * ascent**2
        way = (first / (1 - 0.9**step)) / (np.sqrt(second / (1 - 0.999**step)) + 1e-8)
        wanted = (wanted + share * np.reshape(rate, (-1, 1, 1)) * way).clip(0, 1)
        np.testing.assert_allclose(ours.parameters.numpy(), wanted, atol=2e-5)
    assert ours.done == 4 and wanted.min() == 0 and wanted.max() == 1


@pytest.mark.parametrize("decay", [False, True])
def test_the_rate_falls_with_a_cosine_where_it_is_to(decay: bool) -> None:
    """Along a steady direction Adam goes a whole rate a step."""
    contract = Contract()
    dataset = contract.dataset()
    settings = replace(SETTINGS, learning_rate=0.1, decay=decay)
    problem = Problem(model=contract.model(), dataset=dataset, compositor=TinyCompositor(dataset), settings=settings)
    black = TextureOptimiser(1, settings, derive_rng(0, "black"), None).state()
    monitor = RecordingMonitor(start=black | {"parameters": np.zeros_like(black["parameters"])})
    optimise_textures(
        problem, lambda textures, _: (torch.ones_like(textures), {"gradient": 1.0}), budget=Budget(steps=5),
        rng=derive_rng(0, "optimise_textures"), monitor=monitor,
    )  # fmt: skip
    shares = [0.5 * (1 + math.cos(math.pi * done / 5)) if decay else 1.0 for done in range(5)]
    gone = [float(state["parameters"].mean()) for state in monitor.states]
    assert gone == pytest.approx(np.cumsum(shares) * 0.1, abs=1e-5)


@dataclass(frozen=True)
class Slopes:
    """Terms whose gradients are known: as long as they are said to be."""

    slopes: Mapping[str, tuple[Tensor, float]]

    def terms(self, model: Any, views: Mapping[str, Tensor], samples: Any, indices: Any) -> Mapping[str, Term]:
        return {n: Term(value=(views["left"] * slope).sum(), weight=w) for n, (slope, w) in self.slopes.items()}


@pytest.mark.parametrize("per_term", [True, False])
def test_every_term_has_a_say_of_its_weight_however_long_its_gradient(per_term: bool) -> None:
    generator = torch.Generator().manual_seed(1)
    long, short, textures = (torch.rand(1, 3, 12, 24, generator=generator) for _ in range(3))
    long, textures = 1000 * long, textures.requires_grad_()
    settings = replace(SETTINGS, per_term=per_term, smoothness=0.25, printability=0.0)
    contract = Contract()
    dataset = contract.dataset()
    problem = Problem(model=contract.model(), dataset=dataset, compositor=TinyCompositor(dataset), settings=settings)
    batch = PatchedBatch(views={"left": textures}, samples=[], indices=[])
    direction, values = unit_gradients(problem, Slopes({"a": (long, 0.3), "b": (short, -0.7)}), settings)(
        textures, batch
    )
    scales = (long.norm(), short.norm()) if per_term else (1.0, 1.0)
    total = 0.3 * long / scales[0] - 0.7 * short / scales[1]
    (penalty,) = torch.autograd.grad(smoothness(textures[0]), textures)
    torch.testing.assert_close(direction, total / total.norm() - 0.25 * penalty / penalty.norm(), atol=1e-5, rtol=1e-4)
    assert values["gradient"] == pytest.approx(float(total.norm()), rel=1e-4)


def test_penalties_are_taken_along_but_are_no_gradient_of_the_objective() -> None:
    slope, other = torch.rand(1, 3, 12, 24), torch.rand(1, 3, 12, 24)
    textures = torch.rand(1, 3, 12, 24, requires_grad=True)
    batch = PatchedBatch(views={}, samples=[], indices=[])

    def harm(patches: Tensor, _: PatchedBatch) -> dict[str, Tensor]:
        return {"harm": (patches * slope).sum(), "more": 2 * (patches * slope).sum()}

    def penalties(patches: Tensor) -> dict[str, Tensor]:
        return {"penalty": -(patches * other).sum()}

    direction, values = one_gradient(harm, penalties)(textures, batch)
    torch.testing.assert_close(direction, 3 * slope - other)
    assert values["gradient"] == pytest.approx(float((3 * slope).norm()), rel=1e-5)
    assert set(values) == {"harm", "more", "penalty", "gradient"}
    torch.testing.assert_close(one_gradient(harm)(textures, batch)[0], 3 * slope)
    direction, values = one_gradient(lambda *_: {}, penalties)(textures, batch)
    torch.testing.assert_close(direction, -other)
    assert "gradient" not in values


def test_without_a_surface_there_is_nothing_to_attack() -> None:
    dataset = Contract().dataset()
    bare = [replace(sample, record=replace(sample.record, surfaces=()), surfaces=()) for sample in dataset]
    for nothing in (bare, []):
        problem = Problem(
            model=Contract().model(), dataset=nothing, compositor=TinyCompositor(dataset), settings=SETTINGS
        )
        with pytest.raises(GearError, match="nothing to attack"):
            problem.surfaces()


def test_a_state_of_another_size_is_refused() -> None:
    whole = RecordingMonitor()
    run(whole)
    state = whole.states[-1] | {name: np.zeros((1, 3, 4, 4), np.float32) for name in ARRAYS}
    with pytest.raises(GearError, match=r"patches of \(1, 3, 4, 4\).*start it afresh"):
        run(RecordingMonitor(start=state))


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        ({"mean": np.zeros((1, 3, 12, 1), np.float32)}, r"patches of \(1, 3, 12, 1\), not \(1, 3, 12, 24\)"),
        ({"square": np.zeros((1, 3, 12, 24))}, "its 'square' is no float32"),
        ({"parameters": np.full((1, 3, 12, 24), np.nan, np.float32)}, "its 'parameters' is no float32"),
        ({"done": np.zeros(2, np.int64)}, "its 'done' is no int64"),
        ({"seed": np.array(0.5)}, "its 'seed' is no int64"),
    ],
)
def test_a_damaged_state_is_refused(damage: State, said: str) -> None:
    """Moments of one column would be spread over all of them, in silence."""
    whole = RecordingMonitor()
    run(whole)
    with pytest.raises(GearError, match=f"{said}.*start it afresh$"):
        run(RecordingMonitor(start=dict(whole.states[-1]) | dict(damage)))


def test_a_state_of_an_older_gear_is_refused() -> None:
    whole = RecordingMonitor()
    run(whole)
    state = {name: value for name, value in whole.states[-1].items() if name not in ("has_gradient", "steps_without")}
    with pytest.raises(GearError, match="older gear, it lacks has_gradient, steps_without; start it afresh"):
        run(RecordingMonitor(start=state))


def test_a_model_without_gradients_is_an_error() -> None:
    contract = Contract()
    dataset = contract.dataset()

    class Opaque:
        def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
            return {"logits": torch.zeros(1, 34, *views["left"].shape[2:])}

        def predict(self, views: Any) -> Any:
            raise NotImplementedError

        def taps(self) -> Mapping[str, torch.nn.Module]:
            return {}

    with pytest.raises(GearError, match="no gradient reaches the patch"):
        problem = Problem(model=Opaque(), dataset=dataset, compositor=TinyCompositor(dataset), settings=SETTINGS)
        optimise_textures(
            problem,
            unit_gradients(problem, SemsegObjective(), SETTINGS),
            budget=Budget(steps=50),
            rng=derive_rng(3, "attack"),
        )


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_gradient_that_is_no_number_ends_it_there(value: float) -> None:
    """The textures would be NaN from then on, and what was found before would be lost."""
    contract = Contract()
    dataset = contract.dataset()
    problem = Problem(model=contract.model(), dataset=dataset, compositor=TinyCompositor(dataset), settings=SETTINGS)
    monitor = RecordingMonitor()

    def ascend(textures: Tensor, batch: PatchedBatch) -> tuple[Tensor, dict[str, float]]:
        slope = torch.ones_like(textures)
        slope[0, 0, 0, 0] = value if len(monitor.states) == 2 else 1.0
        return slope, {"gradient": float(slope.norm())}

    with pytest.raises(GearError, match=r"^the gradient of step 3 is NaN or infinite.* sample \d with the patch"):
        optimise_textures(problem, ascend, budget=Budget(steps=5), rng=derive_rng(3, "attack"), monitor=monitor)
    assert len(monitor.states) == 2


def test_looks_differ_and_have_gradients() -> None:
    patch = torch.full((3, 8, 8), 0.5, requires_grad=True)
    looks = [vary(Appearance(), patch, derive_rng(1, "look", n)) for n in range(3)]
    assert not torch.equal(looks[0], looks[1])
    assert torch.equal(looks[2], vary(Appearance(), patch, derive_rng(1, "look", 2)))
    (gradient,) = torch.autograd.grad(looks[0].sum(), patch)
    assert (gradient > 0).any()
    plain = Appearance(noise=0, brightness=0, contrast=0, blur_px=0)
    assert torch.equal(vary(plain, patch, derive_rng(1, "look", 0)), patch)


def test_labels_follow_the_channels() -> None:
    (sample, _) = Contract().dataset()
    by_train_id, by_label_id = train_labels([sample], 19), train_labels([sample], 34)
    building = torch.from_numpy(sample.label_ids == 11)[None]
    assert (by_train_id[building] == 2).all() and (by_label_id[building] == 11).all()
    assert torch.equal(by_train_id == 255, by_label_id == 255)


@pytest.mark.parametrize("options", [{"batch": 0}, {"height_px": 1}, {"smoothness": -1.0}])
def test_bad_settings_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(FieldError, match="must be"):
        Settings(**options)
