"""The attack `ensemble`: through the contract, against several networks, and on a network that it never saw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
import torch

from gear.contracts.attacks import Budget, Patch
from gear.plugins.attacks.ensemble import EnsembleConfig, ensemble
from gear.plugins.attacks.optimisation.model_group import Group
from gear.plugins.attacks.optimisation.objectives import default_objective
from gear.plugins.attacks.scene_specific import SceneSpecificConfig, scene_specific
from gear.testing.attack_contract import AttackContract
from gear.testing.tiny_compositor import TinyCompositor
from gear.testing.tiny_networks import TinyConfig, TinySegmenter
from gear.values.errors import FieldError
from gear.values.rng import derive_rng

SMALL: Mapping[str, Any] = {"height_px": 16, "width_px": 32}


class TestEnsemble(AttackContract):
    spec = ensemble
    options = SMALL
    steps = 40


def harm(model: Any, dataset: Sequence[Any], patches: Sequence[Patch]) -> float:
    """The objective of one network, beside the patch."""
    tensors = [torch.from_numpy(patch.rgb.copy()).permute(2, 0, 1) for patch in patches]
    pictures = TinyCompositor(dataset).compose(tensors, [0, 1], "left")
    with torch.no_grad():
        terms = default_objective(dataset[0]).terms(model, {"left": pictures}, dataset, [0, 1])
    return sum(float(term.weight * term.value) for term in terms.values())


def run(model: Any, dataset: Sequence[Any], attack: Any, steps: int = 40, seed: int = 1) -> tuple[Patch, ...]:
    compositor, rng = TinyCompositor(dataset), derive_rng(seed, "ensemble")
    patches: tuple[Patch, ...] = attack.optimise(model, dataset, compositor, budget=Budget(steps=steps), rng=rng)
    return patches


@pytest.fixture(scope="module")
def dataset() -> list[Any]:
    return AttackContract().dataset()


def network(seed: int, width: int = 8) -> TinySegmenter:
    return TinySegmenter(TinyConfig(seed=seed, width=width))


def test_without_a_focus_it_is_the_scene_specific_attack(dataset: list[Any]) -> None:
    group = Group({"one": network(0), "two": network(1)})
    plain = run(group, dataset, scene_specific.build(SceneSpecificConfig(**SMALL)), steps=3)
    unfocused = run(group, dataset, ensemble.build(EnsembleConfig(**SMALL, focus=0.0)), steps=3)
    focused = run(group, dataset, ensemble.build(EnsembleConfig(**SMALL, focus=50.0)), steps=3)
    np.testing.assert_array_equal(plain[0].rgb, unfocused[0].rgb)
    assert not np.array_equal(plain[0].rgb, focused[0].rgb)


def test_every_network_of_the_ensemble_is_harmed(dataset: list[Any]) -> None:
    members = {str(seed): network(seed) for seed in range(3)}
    patches = run(Group(members), dataset, ensemble.build(EnsembleConfig(**SMALL)))
    for member in members.values():
        drawn = [run(member, dataset, ensemble.build(EnsembleConfig(**SMALL)), steps=0, seed=n) for n in range(4)]
        assert harm(member, dataset, patches) > max(harm(member, dataset, one) for one in drawn)


def test_a_patch_of_two_networks_transfers_to_a_third(dataset: list[Any]) -> None:
    """The third is a relative of the first with other weights, as networks of the same training data are relatives."""
    unseen = network(0)
    with torch.no_grad():
        for parameter in unseen.parameters():
            parameter += 0.05 * torch.randn(parameter.shape, generator=torch.Generator().manual_seed(5))
    surrogates = Group({"one": network(0), "two": network(1)})
    patches = run(surrogates, dataset, ensemble.build(EnsembleConfig(**SMALL)))
    drawn = [run(unseen, dataset, ensemble.build(EnsembleConfig(**SMALL)), steps=0, seed=n) for n in range(8)]
    assert harm(unseen, dataset, patches) > max(harm(unseen, dataset, one) for one in drawn)


def test_a_focus_without_meaning_is_refused() -> None:
    for focus in (-1.0, 101.0, float("nan")):
        with pytest.raises(FieldError, match="focus"):
            EnsembleConfig(focus=focus)
