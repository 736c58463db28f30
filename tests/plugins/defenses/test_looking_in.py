"""The built-in defenses that look into the network."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
import torch
from torch import nn

from gear.contracts.defenses import FitsInPhases
from gear.contracts.models import Model
from gear.plugins.defenses import fpda, hyperneuron, zmask
from gear.plugins.defenses.activations import mask_block
from gear.plugins.defenses.activations.zmask import FILL, _fit_report
from gear.testing.defense_contract import SEED, DefenseContract, noisy_patch, street_picture
from gear.testing.tiny_networks import TinyConfig, TinySegmenter
from gear.values.errors import FieldError, GearError
from gear.values.frames import UInt8Image
from gear.values.rng import derive_rng

SMALL = {"rows": 36, "shallow_kernels": (16, 8, 4, 2), "deep_kernels": (16, 8), "steps": 600}


FEW = {"false_alarms": 0.3}
"""Four pictures tell a level that three in ten exceed, and none that one in twenty does."""


class LookingIn(DefenseContract):
    views = ("left",)
    options: ClassVar = FEW

    def model(self) -> Model:
        return TinySegmenter(TinyConfig())


class TestHyperNeuron(LookingIn):
    spec = hyperneuron.spec


class TestHyperNeuronOfChannels(LookingIn):
    spec = hyperneuron.spec
    options: ClassVar = {**FEW, "statistics": "channel", "aggregate": "rms", "layer": "stem"}


class TestShareOfHyperNeurons(LookingIn):
    spec = hyperneuron.spec
    options: ClassVar = {**FEW, "aggregate": "share"}


class TestFpda(LookingIn):
    spec = fpda.spec


class TestFpdaPeak(LookingIn):
    spec = fpda.spec
    options: ClassVar = {**FEW, "aggregate": "peak", "compress": "mean_abs"}


class TestZMask(LookingIn):
    spec = zmask.spec
    options: ClassVar = {**SMALL, **FEW}


class Siamese(TinySegmenter):
    """Tells of the left picture, as stereo networks do; a pair goes through it as one batch."""

    def forward(self, views, targets=None):  # type: ignore[no-untyped-def]
        return super().forward({"left": torch.cat([views["left"], views["right"]])}, targets)


class TestZMaskOnPairs(LookingIn):
    spec = zmask.spec
    options: ClassVar = {**SMALL, **FEW}
    views = ("left", "right")

    def model(self) -> Model:
        return Siamese(TinyConfig())


ON_TRUNK = {**SMALL, "shallow": ("trunk",), "deep": ("trunk",)}
"""What a patch of noise drives up is rectified before it gets there; in the stem it averages out."""


def street(seed: int) -> UInt8Image:
    """A grey wall, never lit quite the same: what is usual in it is known."""
    rng = derive_rng(SEED, "light", seed)
    lit: UInt8Image = np.clip(120 + rng.normal(0, 2) + rng.normal(0, 4, (64, 128, 3)), 0, 255).astype(np.uint8)
    return lit


def samples(count: int, *, is_patched: bool) -> list[dict[str, UInt8Image]]:
    return [{"left": noisy_patch(street(i), i)[0] if is_patched else street(i)} for i in range(count)]


def overlap(mask: np.ndarray, area: np.ndarray) -> float:
    covered = mask > 0.5
    return float((covered & area).sum() / (covered | area).sum())


@pytest.mark.parametrize("spec", [hyperneuron.spec, fpda.spec, zmask.spec], ids=lambda one: one.name)
def test_patched_pictures_score_above_clean_ones(spec) -> None:  # type: ignore[no-untyped-def]
    model = TinySegmenter(TinyConfig())
    defense = spec.build(spec.config(false_alarms=0.1, **(ON_TRUNK if spec.name == "zmask" else {})))
    state = defense.fit(samples(12, is_patched=False), samples(12, is_patched=True), model, derive_rng(SEED, "fit"))

    def scores(is_patched: bool) -> list[float]:
        shown = [noisy_patch(street(50 + i), 50 + i)[0] if is_patched else street(50 + i) for i in range(6)]
        return [defense.apply({"left": one}, model, state, derive_rng(SEED, "a")).score for one in shown]

    assert min(scores(True)) > max(scores(False))
    assert min(scores(True)) > 0.5


def fitted(**more: object) -> tuple[Model, zmask.ZMask, object]:
    model = TinySegmenter(TinyConfig())
    defense = zmask.build(zmask.ZMaskConfig(**ON_TRUNK, **{"false_alarms": 0.1, **more}))  # type: ignore[arg-type]
    clean, patched = samples(12, is_patched=False), samples(12, is_patched=True)
    return model, defense, defense.fit(clean, patched, model, derive_rng(SEED, "fit"))


def test_zmask_covers_the_patch_and_spares_the_street() -> None:
    model, defense, state = fitted()
    picture, area = noisy_patch(street(77), 77)
    result = defense.apply({"left": picture}, model, state, derive_rng(SEED, "apply"))
    assert result.mask is not None
    assert overlap(result.mask["left"], area) > 0.6
    covered = result.mask["left"] > 0.5
    assert np.array_equal(np.unique(result.views["left"][covered], axis=0), FILL[None])
    assert np.array_equal(result.views["left"][~covered], picture[~covered])


def test_zmask_leaves_alone_what_it_is_not_sure_of() -> None:
    model, defense, state = fitted(only_on_alarm=True, false_alarms=0.08)
    for picture, is_left_alone in ((street(80), True), (noisy_patch(street(80), 1)[0], False)):
        cleaned = defense.apply({"left": picture}, model, state, derive_rng(SEED, "apply")).views["left"]
        assert np.array_equal(cleaned, picture) == is_left_alone


def tensor(*pictures: UInt8Image) -> torch.Tensor:
    return torch.from_numpy(np.stack(pictures)).permute(0, 3, 1, 2).float() / 255


def test_what_zmask_is_not_sure_of_passes_in_a_batch_too() -> None:
    model, defense, state = fitted(only_on_alarm=True, false_alarms=0.08)
    shown = tensor(street(80), noisy_patch(street(80), 1)[0])
    cleaned = defense.forward_fitted({"left": shown}, model, state)["left"]
    assert torch.equal(cleaned[0], shown[0]) and not torch.equal(cleaned[1], shown[1])


def test_a_patch_that_knows_zmask_is_covered_less() -> None:
    model, defense, state = fitted()
    picture, area = noisy_patch(street(77), 77)
    inside = torch.from_numpy(area)
    shown = tensor(picture)
    for _ in range(30):
        shown.requires_grad_(True)
        hidden = (defense.forward_fitted({"left": shown}, model, state)["left"] - shown).square().sum()
        (gradient,) = torch.autograd.grad(hidden, shown)
        assert float(gradient[..., inside].abs().sum()) > 0
        shown = (shown.detach() - 0.02 * gradient.sign() * inside).clamp(0, 1)

    def covered(one: torch.Tensor) -> float:
        seen = (one[0].permute(1, 2, 0).numpy() * 255).round().astype(np.uint8)
        mask = defense.apply({"left": seen}, model, state, derive_rng(SEED, "apply")).mask
        assert mask is not None
        return float((mask["left"][area] > 0.5).mean())

    assert covered(tensor(picture)) > 0.6
    assert covered(shown) < 0.3


def test_a_patch_in_the_right_picture_is_covered_there() -> None:
    model = Siamese(TinyConfig())
    defense = zmask.build(zmask.ZMaskConfig(**ON_TRUNK, false_alarms=0.1))  # type: ignore[arg-type]
    clean = [dict.fromkeys(("left", "right"), sample["left"]) for sample in samples(12, is_patched=False)]
    patched = [dict.fromkeys(("left", "right"), sample["left"]) for sample in samples(12, is_patched=True)]
    state = defense.fit(clean, patched, model, derive_rng(SEED, "fit"))
    picture, area = noisy_patch(street(90), 90)
    mask = defense.apply({"left": street(90), "right": picture}, model, state, derive_rng(SEED, "apply")).mask
    assert mask is not None
    assert overlap(mask["right"], area) > 0.6
    assert (mask["left"] > 0.5).mean() < 0.05


def test_clean_pairs_are_taken_for_attacked_as_often_as_they_may_be() -> None:
    """The score of a pair is that of the picture that shows most of it, and so is its level."""
    model = Siamese(TinyConfig())
    defense = zmask.build(zmask.ZMaskConfig(**ON_TRUNK, false_alarms=0.25))  # type: ignore[arg-type]
    clean = [{"left": street(number), "right": street(number + 50)} for number in range(16)]
    patched = [{name: noisy_patch(picture, 7)[0] for name, picture in sample.items()} for sample in clean]
    state = defense.fit(clean, patched, model, derive_rng(SEED, "fit"))
    scores = [defense.apply(sample, model, state, derive_rng(SEED, "apply")).score for sample in clean]
    assert 0 < sum(score is not None and score > 0.5 for score in scores) <= 4


def test_calibration_data_that_do_not_do_are_refused() -> None:
    model, rng = TinySegmenter(TinyConfig()), derive_rng(SEED, "fit")
    clean, patched = samples(4, is_patched=False), samples(4, is_patched=True)
    other_street = [{"left": 255 - sample["left"]} for sample in patched]
    defense = zmask.build(zmask.ZMaskConfig(**SMALL, false_alarms=0.3))  # type: ignore[arg-type]
    for one, other, problem in (
        (clean, [], "--calibration-patched"),
        (clean, patched[:3], "4 clean samples, and 3"),
        (clean, clean, "no patch is seen"),
        (clean, other_street, "not the scene"),
    ):
        with pytest.raises(GearError, match=problem):
            defense.fit(one, other, model, rng)
    with pytest.raises(GearError, match="at least 4 clean pictures"):
        hyperneuron.build(hyperneuron.HyperNeuronConfig()).fit(clean[:3], [], model, rng)


def test_pictures_of_another_size_than_the_calibration_s_are_refused() -> None:
    model, rng = TinySegmenter(TinyConfig()), derive_rng(SEED, "fit")
    defense = fpda.build(fpda.FpdaConfig(false_alarms=0.3))
    state = defense.fit(samples(4, is_patched=False), [], model, rng)
    with pytest.raises(GearError, match="calibration"):
        defense.apply({"left": street_picture(64, 64, 1)}, model, state, rng)


def test_models_without_taps_are_refused() -> None:
    class Blind(TinySegmenter):
        def taps(self) -> dict[str, nn.Module]:
            return {}

    model, rng = Blind(TinyConfig()), derive_rng(SEED, "fit")
    clean, patched = samples(4, is_patched=False), samples(4, is_patched=True)
    for defense in (zmask.build(zmask.ZMaskConfig()), fpda.build(fpda.FpdaConfig())):
        with pytest.raises(GearError, match="feature maps"):
            defense.fit(clean, patched, model, rng)


def test_options_that_make_no_sense_are_refused() -> None:
    for options in (
        {"rows": 0},
        {"steps": 0},
        {"shallow_kernels": ()},
        {"deep_kernels": (200,)},
        {"false_alarms": 0.0},
    ):
        with pytest.raises(FieldError):
            zmask.ZMaskConfig(**options)  # type: ignore[arg-type]
    for config in (hyperneuron.HyperNeuronConfig, fpda.FpdaConfig):
        with pytest.raises(FieldError):
            config(false_alarms=1.0)


def test_zmask_looks_at_the_layers_that_tell_where_its_patches_are() -> None:
    """Noise averages out in the stem: that layer tells less than the trunk, and would drown it."""
    model = TinySegmenter(TinyConfig())
    defense = zmask.build(zmask.ZMaskConfig(**SMALL, false_alarms=0.1))  # type: ignore[arg-type]
    assert isinstance(defense, FitsInPhases)
    phases: dict[str, tuple[int, int]] = {}
    twins = (samples(12, is_patched=False), samples(12, is_patched=True))
    state = defense.fit_in_phases(
        *twins, model, derive_rng(SEED, "fit"), lambda unit, *step: phases.update({unit: step})
    )
    assert list(phases) == ["clean picture", "layer comparison", "training pair", "training step", "clean score"]
    assert all(done == total > 0 for done, total in phases.values())
    report = state.fit_report()
    assert "trunk" in state.layers.shallow
    assert report.values["loss"] < report.values["constant_loss"] and report.values["mask_iou"] > 0.3
    assert not report.problems


def test_a_mask_that_learnt_nothing_is_reported() -> None:
    """Cells of chance tell nothing about the patch."""
    rng = derive_rng(SEED, "chance")
    truth = torch.zeros(20, 40)
    truth[8:12, 10:14] = 1
    examples = [
        mask_block.Example(
            shallow=torch.from_numpy(rng.random((20, 40), np.float32)),
            deep=torch.from_numpy(rng.random((20, 40), np.float32)),
            truth=truth,
        )
        for _ in range(8)
    ]
    fit = mask_block.fit_of(mask_block.learn(examples, 400, rng), examples)
    assert not fit.has_learnt and fit.iou < 0.05
    assert fit.constant_loss == pytest.approx(0.098, abs=1e-3)
    (problem,) = _fit_report(fit, 8, 19, 0.05, 1.0).problems
    assert problem.startswith("zmask learnt nothing: on its own 8 calibration patches")
