"""Adversarial patch training on a tiny dataset with probes, with an attack that makes what it is told."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import gear
from gear.contracts.attacks import Budget, Patch
from gear.contracts.specs import AttackSpec
from gear.plugins import build as building
from gear.plugins.catalogue import Catalogue, Owner, PluginEntry
from gear.readers import all_of, open_all
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import GearError, PluginError
from gear.values.rng import derive_rng
from gear.verbs.collect.run import collect
from gear.verbs.train import loop
from gear.verbs.train.adversary import Adversary
from gear.verbs.train.checkpoint import TrainingState
from gear.verbs.train.config import Adversarial
from gear.verbs.train.run import train


@dataclass(frozen=True, kw_only=True)
class Config:
    level: float = -1.0


class Painter:
    """Patches of one level, or of drawn ones; looks at the network as a real attack does."""

    def __init__(self, config: Config) -> None:
        self.config = config

    def optimise(
        self, model: Any, dataset: Any, compositor: Any, *, budget: Budget, rng: Any, watch: Any = None
    ) -> Any:
        torch.rand(1)  # attacks may draw from torch's own generator
        grey = torch.full((3, 8, 16), 0.5, requires_grad=True)
        pictures = compositor.compose([grey], range(len(dataset)), "left")
        model.forward({"left": pictures}, dataset)["loss"].backward()
        assert float(grey.grad.abs().sum()) > 0  # type: ignore[union-attr]
        level = rng.random() if self.config.level < 0 else self.config.level
        return (Patch(name="patch_0", rgb=np.full((8, 16, 3), level, np.float32)),)


@pytest.fixture
def painter(install: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = AttackSpec(name="painter", summary="Paints.", config=Config, build=Painter, tasks=("semseg",))
    found = building.catalogue()
    more = PluginEntry(kind="attack", spec=spec, owner=Owner(plugin="p", package="painter", version="1"))
    monkeypatch.setattr(building, "catalogue", lambda: Catalogue((*found.found, more)))


@pytest.fixture(scope="module")
def probed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("probed")
    collect(
        "semseg", out=root, town=TINY_TOWN, scene="board", split="train", samples=4, renderer="classic",
        quality="fast", probes=True,
        settings=[f"scenes={TINY_SCENES}", "options.width_px=128", "options.height_px=64"],
    )  # fmt: skip
    return root


def adversary_of(root: Path, **changes: Any) -> Adversary:
    samples = all_of(open_all([root], "semseg", names=("train",)))
    config = Adversarial(attack="painter", **changes)
    return Adversary(samples, config, task="semseg", seed=0, device=torch.device("cpu"))


class Model:
    def forward(self, views: Any, targets: Any) -> Any:
        return {"loss": views["left"].sum()}


def test_patches_of_the_pool_are_put_on_the_board(probed: Path, painter: None) -> None:
    adversary, sample = adversary_of(probed, share=1.0, pool=2), gear.open_dataset(probed)[0]
    assert adversary.change(sample, 0, derive_rng(0, "x")) is sample
    for epoch in range(3):
        adversary.refresh(Model(), epoch)
    assert len(adversary.state()) == 2
    changed = adversary.change(sample, 0, derive_rng(0, "x"))
    differs = (changed.images["left"] != sample.images["left"]).any(axis=2)
    assert 0 < differs.mean() < 0.5 and changed.label_ids is sample.label_ids
    again = adversary_of(probed, share=1.0, pool=2)
    again.restore(adversary.state())
    assert np.array_equal(again.change(sample, 0, derive_rng(0, "x")).images["left"], changed.images["left"])
    never = adversary_of(probed, share=0.0)
    never.restore(adversary.state())
    assert never.change(sample, 0, derive_rng(0, "x")) is sample


def test_memory_does_not_grow_with_scenes(probed: Path, painter: None, tmp_path: Path) -> None:
    """Every scene, and every weather of it, is a dataset with a compositor of its own."""
    roots = [probed]
    for seed in (5, 6):
        roots.append(tmp_path / f"{seed}")
        collect(
            "semseg", out=roots[-1], town=TINY_TOWN, scene="board", split="train", samples=2, seed=seed,
            renderer="classic", quality="fast", probes=True,
            settings=[f"scenes={TINY_SCENES}", "options.width_px=128", "options.height_px=64"],
        )  # fmt: skip
    samples = all_of(open_all(roots, "semseg", names=("train",)))

    def shown(most: int) -> tuple[list[Any], int]:
        config = Adversarial(attack="painter", share=1.0)
        one = Adversary(samples, config, task="semseg", seed=0, device=torch.device("cpu"), cache_bytes=most)
        one.refresh(Model(), 0)
        rngs = (derive_rng(0, "x", i) for i in range(len(samples)))
        pictures = [one.change(samples[i], i, rng).images["left"] for i, rng in enumerate(rngs)]
        caches = {id(engine._cache): engine._cache.nbytes for engine in one._compositors.values()}
        return pictures, sum(caches.values())

    whole, needed = shown(1 << 30)
    few, kept = shown(needed // 3)
    assert 0 < kept <= needed // 3 and needed > len(samples) * 128 * 64 * 3
    assert all(np.array_equal(one, other) for one, other in zip(few, whole, strict=True))


class StopError(Exception):
    """A power cut."""


@pytest.mark.parametrize("stop_at", [1, 2, 3])
def test_training_against_patches_is_taken_up_again(
    probed: Path, painter: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stop_at: int
) -> None:
    monkeypatch.setattr(loop, "CHECKPOINT_EVERY_S", 0.0)

    def run(out: str, watch: Any = None) -> Path:
        settings = ["adversarial.share=1", "adversarial.samples=2"]
        return train(
            "semseg", "tiny_segmenter", probed, out=tmp_path / out, epochs=3, batch=2, adversarial="painter",
            settings=settings, on_step=watch,
        ).weights  # fmt: skip

    def stop(progress: TrainingState, share: float, metrics: Any) -> None:
        if progress.step == stop_at:
            raise StopError

    whole = run("whole")
    with pytest.raises(StopError):
        run("parts", stop)
    assert run("parts").read_bytes() == whole.read_bytes()
    plain = train("semseg", "tiny_segmenter", probed, out=tmp_path / "plain", epochs=3, batch=2).weights
    assert plain.read_bytes() != whole.read_bytes()
    config = json.loads((tmp_path / "whole" / "train.json").read_text())["config"]
    assert config["adversarial"]["attack"] == "painter"


@pytest.mark.parametrize(
    ("facts", "message"),
    [
        ({"needs_gradients": False}, "'painter' is counted in forward passes"),
        ({"max_surfaces": 0}, "'painter' makes up to 0 patches; .* has 1 surfaces"),
    ],
)
def test_attacks_that_cannot_do_it_are_refused(
    probed: Path, painter: None, monkeypatch: pytest.MonkeyPatch, facts: dict[str, Any], message: str
) -> None:
    *others, found = building.catalogue().found
    odd = Catalogue((*others, replace(found, spec=replace(found.spec, **facts))))
    monkeypatch.setattr(building, "catalogue", lambda: odd)
    with pytest.raises(GearError, match=message):
        adversary_of(probed)


class Careless(Painter):
    """Returns what it must not."""

    def optimise(self, *given: Any, **named: Any) -> Any:
        return [(), (Patch(name="poster", rgb=np.zeros((4, 8, 3), np.float32)),), None, (np.zeros((4, 8, 3)),)][
            int(self.config.level)
        ]


@pytest.mark.parametrize("level", [0.0, 1.0, 2.0, 3.0])
def test_an_attack_that_breaks_its_promise_is_named(
    probed: Path, painter: None, monkeypatch: pytest.MonkeyPatch, level: float
) -> None:
    *others, found = building.catalogue().found
    odd = Catalogue((*others, replace(found, spec=replace(found.spec, build=lambda _: Careless(Config(level=level))))))
    monkeypatch.setattr(building, "catalogue", lambda: odd)
    with pytest.raises(PluginError, match=r"plugin painter \(painter 1\) failed at optimise: must return"):
        adversary_of(probed).refresh(Model(), 0)


def test_what_is_missing_is_said(street: Callable[..., Path], painter: None, tmp_path: Path) -> None:
    with pytest.raises(GearError, match="probes"):
        train("semseg", "tiny_segmenter", street("semseg"), out=tmp_path / "a", adversarial="painter", epochs=1)
    with pytest.raises(GearError, match="'painter' is for semseg, not depth"):
        train("depth", "tiny_depth", street("depth"), out=tmp_path / "b", adversarial="painter")
