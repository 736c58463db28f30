"""The attack contract, held by a small honest attack and broken by dishonest ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import torch

from gear.contracts.attacks import Patch
from gear.contracts.specs import AttackSpec
from gear.testing.attack_contract import AttackContract
from gear.testing.tiny_compositor import TinyCompositor


@dataclass(frozen=True, kw_only=True)
class Config:
    side_px: int = 16


class Ascent:
    """Sign gradient ascent on the loss."""

    def __init__(self, config: Config) -> None:
        self.config = config

    def optimise(
        self, model: Any, dataset: Any, compositor: Any, *, budget: Any, rng: np.random.Generator, monitor: Any = None
    ) -> Any:
        side = self.config.side_px
        start = rng.uniform(0.4, 0.6, (len(dataset[0].record.surfaces), 3, side, 2 * side)).astype(np.float32)
        patches = torch.from_numpy(start)
        indices = range(len(dataset))
        for _ in range(budget.steps):
            patches.requires_grad_(True)
            pictures = compositor.compose(list(patches), indices, "left")
            loss = torch.stack(list(model.forward({"left": pictures}, list(dataset)).values())).sum()
            (gradient,) = torch.autograd.grad(loss, patches)
            patches = (patches.detach() + 0.1 * gradient.sign()).clamp(0, 1)
        return tuple(Patch(name=f"patch_{n}", rgb=p.permute(1, 2, 0).numpy()) for n, p in enumerate(patches))


ascent = AttackSpec(name="ascent", summary="Sign gradient ascent.", config=Config, build=Ascent)


class Search(Ascent):
    """Random search, without gradients."""

    def optimise(
        self, model: Any, dataset: Any, compositor: Any, *, budget: Any, rng: np.random.Generator, monitor: Any = None
    ) -> Any:
        assert budget.queries is not None
        best, best_loss = None, -np.inf
        for _ in range(budget.queries):
            patches = rng.integers(0, 2, (len(dataset[0].record.surfaces), 3, 4, 8)).astype(np.float32)
            pictures = compositor.compose(list(torch.from_numpy(patches)), range(len(dataset)), "left")
            with torch.no_grad():
                loss = float(sum(model.forward({"left": pictures}, list(dataset)).values()))
            if loss > best_loss:
                best, best_loss = patches, loss
        assert best is not None
        return tuple(Patch(name=f"patch_{n}", rgb=p.transpose(1, 2, 0).copy()) for n, p in enumerate(best))


class TestAscent(AttackContract):
    spec = ascent


class TestAscentOnDepth(AttackContract):
    spec = ascent
    task = "depth"


class TestSearch(AttackContract):
    spec = AttackSpec(name="search", summary="Random.", config=Config, build=Search, needs_gradients=False)


class Trains(Ascent):
    def optimise(self, model: Any, dataset: Any, compositor: Any, **rest: Any) -> Any:
        model.network.train()
        patches = super().optimise(model, dataset, compositor, **rest)
        model.network.eval()
        return patches


class Litters(Ascent):
    def optimise(self, model: Any, dataset: Any, compositor: Any, **rest: Any) -> Any:
        pictures = compositor.compose([torch.zeros(3, 4, 4)] * compositor.surfaces, [0], "left")
        model.forward({"left": pictures}, list(dataset[:1]))["loss"].backward()
        return super().optimise(model, dataset, compositor, **rest)


class Draws(Ascent):
    def optimise(self, *rest: Any, rng: Any, **more: Any) -> Any:
        return super().optimise(*rest, rng=np.random.default_rng(int(torch.randint(1 << 30, ()))), **more)


class Spends(Ascent):
    def optimise(self, model: Any, dataset: Any, *rest: Any, **more: Any) -> Any:
        for _ in range(20):
            model.predict(dataset[0].images)
        return super().optimise(model, dataset, *rest, **more)


class Loud(Ascent):
    def optimise(self, *rest: Any, **more: Any) -> Any:
        return tuple(Patch(name=p.name, rgb=p.rgb * 255) for p in super().optimise(*rest, **more))


class Kind(Ascent):
    def optimise(self, *rest: Any, **more: Any) -> Any:
        return tuple(Patch(name=p.name, rgb=np.full_like(p.rgb, 0.5)) for p in super().optimise(*rest, **more))


@pytest.mark.parametrize(
    ("build", "test"),
    [
        (Trains, "test_the_model_is_left_as_it_was"),
        (Litters, "test_the_model_is_left_as_it_was"),
        (Draws, "test_the_same_generator_gives_the_same_patch"),
        (Spends, "test_it_stays_within_its_budget"),
        (Loud, "test_patches_are_pictures"),
        (Kind, "test_it_does_harm"),
    ],
)
def test_the_contract_catches(build: Any, test: str) -> None:
    spec = AttackSpec(name="liar", summary="Breaks a promise.", config=Config, build=build)
    with pytest.raises(AssertionError):
        getattr(type("Liar", (AttackContract,), {"spec": spec})(), test)()


def test_the_compositor_paints_the_surface_and_nothing_else() -> None:
    dataset = TestAscent().dataset()
    compositor = TinyCompositor(dataset)
    red, blue = torch.tensor([1.0, 0, 0]).view(3, 1, 1), torch.tensor([0, 0, 1.0]).view(3, 1, 1)
    halves = torch.cat([red.expand(3, 8, 8), blue.expand(3, 8, 8)], dim=2)
    picture = compositor.compose([halves], [0], "left")[0].permute(1, 2, 0).numpy()
    plain = dataset[0].images["left"] / 255
    changed = np.abs(picture - plain).max(axis=2) > 0.01
    assert changed.sum() == pytest.approx(dataset[0].surfaces[0].visible_px, abs=2)
    columns = np.flatnonzero(changed.any(axis=0))
    rows = np.flatnonzero(changed.any(axis=1))
    middle = (rows[0] + rows[-1]) // 2
    assert picture[middle, columns[0] + 1].argmax() == 0 and picture[middle, columns[-1] - 1].argmax() == 2
    with pytest.raises(ValueError, match="1 surfaces, got 2 patches"):
        compositor.compose([halves, halves], [0], "left")
