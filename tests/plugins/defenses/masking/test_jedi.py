"""Jedi: promises, stages, calibration, and an attack that knows the defense."""

from __future__ import annotations

import functools
from typing import Any, ClassVar

import cv2
import numpy as np
import pytest
import torch

from gear.contracts.defenses import Defense, DifferentiableDetector, FittedDefense, ReportsFit
from gear.contracts.models import Model
from gear.plugins.defenses import jedi
from gear.plugins.defenses.masking.jedi import PUBLISHED, Jedi, _window_shares
from gear.plugins.defenses.masking.jedi_options import JediConfig
from gear.testing.defense_contract import SEED, DefenseContract, noisy_patch, street_picture
from gear.testing.tiny_networks import TinyConfig, TinySegmenter
from gear.values.errors import FieldError, GearError
from gear.values.frames import UInt8Image
from gear.values.rng import derive_rng

QUICK = {"rows": 12, "epochs": 30, "draws": 60}


@functools.cache
def calibrated(width_px: int = 128, height_px: int = 72, **options: Any) -> Any:
    clean = [{"left": street_picture(width_px, height_px, i)} for i in range(8)]
    patched = [{"left": noisy_patch(sample["left"], i)[0]} for i, sample in enumerate(clean)]
    return Jedi(JediConfig(**{**QUICK, **options})).fit(clean, patched, None, derive_rng(SEED, "fit"))


class TestJedi(DefenseContract):
    spec = jedi.spec
    options: ClassVar = QUICK

    def model(self) -> Model:
        return TinySegmenter(TinyConfig())

    def state(self, defense: Defense) -> Any:
        return calibrated()


class TestUncalibratedJediOnOddSizes(DefenseContract):
    spec = jedi.spec
    size_px = (83, 41)
    views = ("left",)

    def state(self, defense: Defense) -> None:
        return None


def test_it_speaks_the_protocols_of_adaptive_attacks() -> None:
    made = Jedi(JediConfig())
    assert isinstance(made, DifferentiableDetector) and isinstance(made, FittedDefense)
    assert isinstance(calibrated(), ReportsFit)


def test_thresholds_are_those_of_the_authors_formula() -> None:
    """5.32 + 1.5 * 0.32 - 2 * (5.32 - 2.75) / 5.32 * 0.32 + (4.45 - 2.75) / 1.16 * 0.32"""
    assert PUBLISHED[0].threshold(4.45) == pytest.approx(5.95980, abs=1e-5)
    assert PUBLISHED[2].threshold(3.47) == pytest.approx(6.47 + 0.35 * (1.5 - 2 * 3.0 / 6.47), abs=1e-9)


def test_window_shares_count_the_pixels_of_each_window() -> None:
    area = np.zeros((20, 30), np.bool_)
    area[4:13, 8:20] = True
    shares = _window_shares(area, 8)
    extended = np.pad(area, 4, mode="symmetric")
    for i in range(5):
        for j in range(8):
            window = extended[4 * i : 4 * i + 9, 4 * j : 4 * j + 9]
            assert shares[i, j] == pytest.approx(window.mean(), abs=1e-6)


def overlap(mask: np.ndarray, area: np.ndarray) -> float:
    return float((mask & area).sum() / (mask | area).sum())


@pytest.mark.parametrize(("is_calibrated", "least_iou"), [(False, 0.7), (True, 0.55)])
def test_it_inpaints_the_patch_and_spares_the_street(is_calibrated: bool, least_iou: float) -> None:
    """The quick autoencoder of the tests has cells of 12 pixels, which lowers the overlap."""
    street = street_picture(256, 144, 77)
    patched, area = noisy_patch(street, 77)
    defense, state = Jedi(JediConfig()), calibrated(256, 144) if is_calibrated else None
    result = defense.apply({"left": patched}, None, state, derive_rng(SEED, "apply"))
    assert result.mask is not None
    located = result.mask["left"] > 0.5
    assert overlap(located, area) > least_iou
    assert result.score == pytest.approx(located.mean())
    assert np.array_equal(result.views["left"][~located], patched[~located])
    assert np.abs(np.diff(result.views["left"][located & area].astype(float), axis=0)).mean() < 12
    bare = defense.apply({"left": street}, None, state, derive_rng(SEED, "apply"))
    assert bare.score == 0 and np.array_equal(bare.views["left"], street)


def test_small_components_are_removed() -> None:
    street = street_picture(256, 144, 3).copy()
    rng = derive_rng(SEED, "speck")
    street[20:30, 20:30] = rng.integers(0, 256, (10, 10, 3))
    street[60:110, 100:180] = rng.integers(0, 256, (50, 80, 3))
    kept, every = (Jedi(JediConfig(least_share=share)).locate(street, None) for share in (0.005, 0.0))
    assert every[22:28, 22:28].any() and not kept[10:40, 10:40].any()
    counts = [cv2.connectedComponents(mask.astype(np.uint8))[0] - 1 for mask in (kept, every)]
    assert counts[0] == 1 and counts[1] >= 2


def test_the_calibration_measures_entropies_and_its_own_masks() -> None:
    state = calibrated()
    report = state.fit_report()
    assert report.problems == ()
    assert report.values["pictures"] == 8
    assert report.values["patch_bits"] > report.values["clean_bits"] + 2
    published, measured = (report.values[f"mask_iou_{one}_statistics"] for one in ("published", "measured"))
    assert 0.5 < report.values["mask_iou"] <= 1 and max(published, measured) > 0.5
    assert (state.statistics is PUBLISHED) == (published >= measured)
    assert calibrated(autoencoder=False).autoencoder is None


def test_patches_without_entropy_are_reported() -> None:
    clean = [{"left": noisy_patch(street_picture(128, 72, i), i)[0]} for i in range(4)]
    patched = [{"left": sample["left"].copy()} for sample in clean]
    for sample in patched:
        sample["left"][20:30, 50:90] = 128
    state = Jedi(JediConfig(**QUICK)).fit(clean, patched, None, derive_rng(SEED, "fit"))
    assert any("learnt nothing" in line for line in state.fit_report().problems)
    assert any("bits of local entropy" in line for line in state.fit_report().problems)


def test_calibration_data_that_are_no_twins_are_refused() -> None:
    clean = [{"left": street_picture(128, 72, i)} for i in range(3)]
    rng = derive_rng(SEED, "fit")
    for patched, problem in (
        ([], "--calibration-patched"),
        (clean[:2], "3 clean samples, and 2"),
        (clean, "no patch is seen"),
        ([{"left": 255 - sample["left"]} for sample in clean], "not the scene"),
    ):
        with pytest.raises(GearError, match=problem):
            Jedi(JediConfig()).fit(clean, patched, None, rng)


def tensor(picture: UInt8Image) -> torch.Tensor:
    return torch.from_numpy(picture.copy()).permute(2, 0, 1)[None].float() / 255


def test_a_picture_that_is_one_patch_becomes_grey() -> None:
    noise = derive_rng(SEED, "noise").integers(0, 256, (64, 64, 3), dtype=np.uint8)
    filled = Jedi(JediConfig()).fill(noise, np.ones((64, 64), np.bool_))
    assert np.all(filled == 128)


@pytest.mark.parametrize("is_calibrated", [False, True])
def test_a_patch_that_knows_jedi_is_located_less(is_calibrated: bool) -> None:
    picture, area = noisy_patch(street_picture(128, 72, 5), 5)
    defense, state = Jedi(JediConfig()), calibrated() if is_calibrated else None
    model = TinySegmenter(TinyConfig())
    inside = torch.from_numpy(area)
    shown = tensor(picture)
    before = defense.defend_batch({"left": shown}, model, state)
    assert before.masks is not None and before.scores is not None
    assert float(before.scores[0]) == pytest.approx(float(defense.locate(picture, state).mean()), abs=1e-5)
    for _ in range(30):
        shown = shown.detach().requires_grad_(True)
        batch = defense.defend_batch({"left": shown}, model, state)
        assert batch.masks is not None and batch.scores is not None
        (gradient,) = torch.autograd.grad(batch.masks["left"].mean() + batch.scores.sum(), shown)
        shown = (shown.detach() - 0.03 * gradient.sign() * inside).clamp(0, 1)
    levels = (shown[0].permute(1, 2, 0).numpy() * 255).round().astype(np.uint8)
    assert defense.locate(picture, state)[area].mean() > 0.6
    assert defense.locate(levels, state)[area].mean() < 0.2


@pytest.mark.parametrize(
    "options",
    [{"least_share": 1.0}, {"radius_px": 0}, {"rows": 0}, {"hidden": 0}, {"epochs": 0}, {"max_pictures": 0}],
)
def test_absurd_options_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(FieldError, match=next(iter(options))):
        JediConfig(**options)  # type: ignore[arg-type]
