"""NutNet: promises, calibration, and an attack that knows the defense."""

from __future__ import annotations

import functools
from typing import Any, ClassVar

import numpy as np
import pytest
import torch

from gear.contracts.defenses import Defense
from gear.contracts.models import Model
from gear.plugins.defenses import nutnet
from gear.plugins.defenses.masking.nutnet import AUTHORS_THRESHOLD, NutNet
from gear.plugins.defenses.masking.nutnet_options import NutNetConfig
from gear.testing.defense_contract import SEED, DefenseContract, noisy_patch, street_picture
from gear.testing.tiny_networks import TinyConfig, TinySegmenter
from gear.values.errors import FieldError, GearError
from gear.values.rng import derive_rng

QUICK = {"steps": 300, "width_px": 128}


@functools.cache
def calibrated(*, is_clean_only: bool = False, **options: Any) -> Any:
    clean = [{"left": street_picture(128, 72, i)} for i in range(8)]
    patched = [] if is_clean_only else [{"left": noisy_patch(one["left"], i)[0]} for i, one in enumerate(clean)]
    return NutNet(NutNetConfig(**{**QUICK, **options})).fit(clean, patched, None, derive_rng(SEED, "fit"))


class TestNutNet(DefenseContract):
    spec = nutnet.spec
    options: ClassVar = QUICK

    def model(self) -> Model:
        return TinySegmenter(TinyConfig())

    def state(self, defense: Defense) -> Any:
        return calibrated()


@pytest.mark.parametrize("is_clean_only", [False, True])
def test_it_covers_the_patch_in_grey_and_spares_the_street(is_clean_only: bool) -> None:
    street = street_picture(128, 72, 77)
    patched, area = noisy_patch(street, 77)
    defense, state = NutNet(NutNetConfig(**QUICK)), calibrated(is_clean_only=is_clean_only)
    result = defense.apply({"left": patched}, None, state, derive_rng(SEED, "apply"))
    assert result.mask is not None
    located = result.mask["left"] > 0.5
    assert located[area].mean() > 0.75 and located[~area].mean() < 0.1
    assert np.all(result.views["left"][located] == 128)
    assert np.array_equal(result.views["left"][~located], patched[~located])
    assert defense.locate(street, state).mean() < 0.05


def test_the_calibration_says_what_it_learnt() -> None:
    values = calibrated().fit_report().values
    assert set(values) == {
        "pictures", "clean_error", "patch_error", "mask_iou", "threshold", "masked_share_of_clean"
    }  # fmt: skip
    assert values["patch_error"] > 3 * values["clean_error"] and values["mask_iou"] > 0.5
    assert values["clean_error"] < values["threshold"] < values["patch_error"]
    assert calibrated().fit_report().problems == ()
    alone = calibrated(is_clean_only=True)
    assert alone.threshold == AUTHORS_THRESHOLD and "mask_iou" not in alone.fit_report().values


def test_a_threshold_of_the_options_is_kept() -> None:
    state = calibrated(coarse_threshold=0.2, steps=1)
    assert state.threshold == 0.2 == state.fit_report().values["threshold"]


def test_a_calibration_that_learnt_nothing_is_reported() -> None:
    (problem,) = calibrated(coarse_threshold=4.0, steps=1).fit_report().problems
    assert problem.startswith("nutnet learnt nothing")


def test_without_clean_pictures_it_is_refused() -> None:
    with pytest.raises(GearError, match="nutnet learns from clean pictures"):
        NutNet(NutNetConfig()).fit([], [], None, derive_rng(SEED, "fit"))


def test_an_attack_finds_patches_that_the_autoencoder_reconstructs() -> None:
    """Descending along the mask's gradient hides the patch from the defense."""
    patched, area = noisy_patch(street_picture(128, 72, 5), 5)
    defense, state, model = NutNet(NutNetConfig(**QUICK)), calibrated(), TinySegmenter(TinyConfig())
    shown = torch.from_numpy(patched.copy()).permute(2, 0, 1)[None].float() / 255
    where = torch.from_numpy(area)[None, None]
    texture = shown.clone().requires_grad_()
    before = defense.locate(patched, state)[area].mean()
    optimiser = torch.optim.Adam([texture], lr=0.05)
    for _ in range(60):
        batch = defense.defend_batch({"left": torch.where(where, texture.clamp(0, 1), shown)}, model, state)
        assert batch.masks is not None
        optimiser.zero_grad()
        batch.masks["left"].sum().backward()  # type: ignore[no-untyped-call]
        optimiser.step()
    found = torch.where(where, texture.detach().clamp(0, 1), shown)
    hidden = (found[0].permute(1, 2, 0).numpy() * 255).round().astype(np.uint8)
    assert defense.locate(hidden, state)[area].mean() < before / 4


@pytest.mark.parametrize(
    "options", [{"width_px": 8}, {"steps": 0}, {"coarse_threshold": 0.0}, {"fine_threshold": 7.0}, {"max_pictures": 0}]
)
def test_options_are_checked(options: dict[str, Any]) -> None:
    with pytest.raises(FieldError, match=next(iter(options))):
        NutNetConfig(**options)


def test_tiny_pictures_have_a_mask() -> None:
    defense = NutNet(NutNetConfig(**QUICK))
    assert defense.locate(street_picture(20, 9, 0), calibrated()).shape == (9, 20)
