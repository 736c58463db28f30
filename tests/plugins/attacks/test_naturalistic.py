"""The attack `naturalistic`: through the contract, and its patches stay in the prior's set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
import pytest
import torch
from scipy.fft import dctn

from gear.contracts.attacks import Patch
from gear.plugins.attacks.naturalistic import Naturalistic, NaturalisticConfig, naturalistic
from gear.plugins.attacks.optimisation.objectives import default_objective
from gear.testing.attack_contract import AttackContract, Counted
from gear.testing.tiny_compositor import TinyCompositor
from gear.values.errors import FieldError
from gear.values.rng import derive_rng

SMALL: Mapping[str, Any] = {"height_px": 16, "width_px": 32, "modes": 12}


class Beside(AttackContract):
    """The contract, with harm measured where the attack does it: in the pixels beside the patch."""

    def harm(self, model: Counted, dataset: Sequence[Any], patches: Sequence[Patch]) -> float:
        tensors = [torch.from_numpy(patch.rgb.copy()).permute(2, 0, 1) for patch in patches]
        pictures = TinyCompositor(dataset).compose(tensors, [0, 1], "left")
        with torch.no_grad():
            terms = default_objective(dataset[0]).terms(model, {"left": pictures}, dataset, [0, 1])
        return sum(float(term.weight * term.value) for term in terms.values())


class TestOnSemseg(Beside):
    spec = naturalistic
    options = SMALL
    steps = 40


class TestOnDepth(AttackContract):
    spec = naturalistic
    options = SMALL
    task = "depth"


class TestOneGradient(Beside):
    spec = naturalistic
    options: ClassVar[Mapping[str, Any]] = {**SMALL, "smoothness": 0.1, "per_term": False}
    steps = 40


def test_the_patch_harms_more_than_random_patches_of_the_prior() -> None:
    """So that the effect is that of the optimisation, and not that of the prior."""
    contract = TestOnSemseg()
    model, dataset = contract.model(), contract.dataset()
    found = contract.harm(model, dataset, contract.attack(model, dataset, steps=60))
    drawn = [contract.harm(model, dataset, contract.attack(model, dataset, steps=0, seed=seed)) for seed in range(12)]
    assert found > max(drawn)


def test_an_optimised_patch_has_no_wave_beyond_the_prior_and_a_falling_spectrum() -> None:
    contract = TestOnSemseg()
    (patch,) = contract.attack(contract.model(), contract.dataset(), steps=60)
    amplitude = np.abs(dctn(patch.rgb.mean(axis=2), norm="ortho"))
    u, v = np.meshgrid(np.arange(16) * 2, np.arange(32), indexing="ij")
    radius = np.hypot(u, v)
    means = [np.sqrt((amplitude[(radius >= low) & (radius < 2 * low)] ** 2).mean()) for low in (1, 2, 4)]
    assert means[0] > 1.2 * means[1] > 1.44 * means[2]
    beyond = (amplitude[radius > 13] ** 2).sum() / (amplitude[radius > 0] ** 2).sum()
    assert beyond < 0.05, "clipping alone adds short waves"


def test_options_that_have_no_meaning_are_refused() -> None:
    for options, field in (
        ({"modes": 1}, "modes"),
        ({"contrast": 0.0}, "contrast"),
        ({"slack": 0.5}, "slack"),
        ({"slack": float("nan")}, "slack"),
        ({"gamma": 2.0}, "gamma"),
    ):
        with pytest.raises(FieldError) as caught:
            NaturalisticConfig(**options)
        assert field in str(caught.value)


def test_the_size_of_the_patch_does_not_change_its_pattern() -> None:
    """The coefficients are the patch; the number of pixels only samples it."""
    small, large = (
        Naturalistic(NaturalisticConfig(height_px=25 * n, width_px=50 * n, modes=16)).parametrisation() for n in (1, 3)
    )
    coefficients = small.first(1, derive_rng(0, "size"))
    assert coefficients.shape == large.shape(1)
    middles = large.textures(coefficients)[..., 1::3, 1::3]
    np.testing.assert_allclose(middles.numpy(), small.textures(coefficients).numpy(), atol=1e-5)
