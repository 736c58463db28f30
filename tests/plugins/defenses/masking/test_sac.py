"""SAC: promises, calibration, and an attack that knows the defense."""

from __future__ import annotations

import functools
from typing import Any, ClassVar

import numpy as np
import pytest
import torch

from gear.contracts.defenses import Defense
from gear.contracts.models import Model
from gear.plugins.defenses import sac
from gear.plugins.defenses.masking.sac import Sac, _sizes
from gear.plugins.defenses.masking.sac_options import SacConfig
from gear.testing.defense_contract import SEED, DefenseContract, noisy_patch, street_picture
from gear.testing.tiny_networks import TinyConfig, TinySegmenter
from gear.values.errors import FieldError, GearError
from gear.values.rng import derive_rng

QUICK = {"filters": 4, "steps": 60, "width_px": 128}


@functools.cache
def calibrated(**options: Any) -> Any:
    clean = [{"left": street_picture(128, 72, i)} for i in range(8)]
    patched = [{"left": noisy_patch(sample["left"], i)[0]} for i, sample in enumerate(clean)]
    return Sac(SacConfig(**{**QUICK, **options})).fit(clean, patched, None, derive_rng(SEED, "fit"))


class TestSac(DefenseContract):
    spec = sac.spec
    options: ClassVar = QUICK

    def model(self) -> Model:
        return TinySegmenter(TinyConfig())

    def state(self, defense: Defense) -> Any:
        return calibrated()


def test_it_covers_the_patch_in_black_and_spares_the_street() -> None:
    street = street_picture(128, 72, 77)
    patched, area = noisy_patch(street, 77)
    defense = Sac(SacConfig(**QUICK))
    result = defense.apply({"left": patched}, None, calibrated(), derive_rng(SEED, "apply"))
    assert result.mask is not None
    located = result.mask["left"] > 0.5
    assert located[area].mean() > 0.95 and located[~area].mean() < 0.15
    bare = Sac(SacConfig(**QUICK, completes_shape=False)).locate(patched, calibrated())
    assert (bare & area).sum() / (bare | area).sum() > 0.7
    assert np.all(result.views["left"][located] == 0)
    assert np.array_equal(result.views["left"][~located], patched[~located])
    assert defense.locate(street, calibrated()).mean() < 0.02


def test_the_calibration_reports_pictures_that_it_did_not_train_on() -> None:
    report = calibrated().fit_report()
    assert report.problems == ()
    assert report.values["pictures"] == 6
    assert report.values["mask_iou"] > 0.5 and report.values["mask_iou_held_out"] > 0.5


def test_a_segmenter_that_learnt_nothing_is_reported() -> None:
    clean = [{"left": street_picture(128, 72, i)} for i in range(4)]
    patched = [{"left": noisy_patch(sample["left"], i)[0]} for i, sample in enumerate(clean)]
    state = Sac(SacConfig(filters=2, steps=1)).fit(clean, patched, None, derive_rng(SEED, "fit"))
    (problem,) = state.fit_report().problems
    assert problem.startswith("sac learnt nothing")


def test_rectangles_have_the_proportions_of_the_authors_squares() -> None:
    small, large = torch.zeros(50, 80), torch.zeros(50, 80)
    small[3:7, 5:11] = 1
    large[10:30, 20:60] = 1
    assert _sizes([small, large]) == ((20, 40), (15, 30), (10, 20), (5, 10))


def test_patches_that_vanish_in_the_reduced_picture_are_refused() -> None:
    clean = [{"left": street_picture(256, 144, 1)}]
    patched = [{"left": clean[0]["left"].copy()}]
    patched[0]["left"][50:52, 60:62] = 255 - patched[0]["left"][50:52, 60:62]
    with pytest.raises(GearError, match="width_px"):
        Sac(SacConfig(width_px=32)).fit(clean, patched, None, derive_rng(SEED, "fit"))


def test_a_patch_that_knows_sac_is_located_less() -> None:
    picture, area = noisy_patch(street_picture(128, 72, 5), 5)
    defense, state, model = Sac(SacConfig(**QUICK)), calibrated(), TinySegmenter(TinyConfig())
    inside = torch.from_numpy(area)
    shown = torch.from_numpy(picture.copy()).permute(2, 0, 1)[None].float() / 255
    for _ in range(40):
        shown = shown.detach().requires_grad_(True)
        batch = defense.defend_batch({"left": shown}, model, state)
        assert batch.masks is not None and batch.scores is not None
        (gradient,) = torch.autograd.grad(batch.masks["left"].mean() + batch.scores.sum(), shown)
        shown = (shown.detach() - 0.02 * gradient.sign() * inside).clamp(0, 1)
    levels = (shown[0].permute(1, 2, 0).numpy() * 255).round().astype(np.uint8)
    assert defense.locate(picture, state)[area].mean() > 0.7
    assert defense.locate(levels, state)[area].mean() < 0.3


@pytest.mark.parametrize("options", [{"width_px": 8}, {"filters": 1}, {"steps": 0}, {"max_pictures": 0}])
def test_absurd_options_are_refused(options: dict[str, int]) -> None:
    with pytest.raises(FieldError, match=next(iter(options))):
        SacConfig(**options)  # type: ignore[arg-type]
