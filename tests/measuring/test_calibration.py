"""Defenses that learn first, in `gear evaluate`, `gear attack` and `gear gap`."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gear
from gear.contracts.defenses import DefenseResult
from gear.contracts.specs import DefenseSpec
from gear.testing.tiny_networks import tiny_segmenter
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import GearError
from gear.verbs.attack.run import attack
from gear.verbs.evaluate.run import evaluate
from tests.verbs.conftest import Copy, Install, Nothing, Small, verified


class Learner:
    """Makes bright pixels black from a level on that it has learnt: the mean of the clean pictures."""

    def __init__(self, config: Nothing) -> None:
        self.fits: list[tuple[int, int]] = []
        self.drawn: list[int] = []

    def fit(self, clean: Any, patched: Any, model: Any, rng: np.random.Generator) -> float:
        self.fits.append((len(clean), len(patched)))
        self.drawn.append(int(rng.integers(2**31)))
        return float(np.mean([views["left"].mean() for views in clean]))

    def apply(self, views: Any, model: Any, state: float, rng: np.random.Generator) -> DefenseResult:
        assert "stem" in model.taps()
        cleaned = {name: np.where(one > state, 0, one).astype(np.uint8) for name, one in views.items()}
        return DefenseResult(views=cleaned, score=0.0)

    def forward(self, views: Any) -> Any:
        raise ValueError("has no gradient")

    def wrap(self, model: Any) -> Any:
        return model


@pytest.fixture
def learner(install: Install) -> list[Learner]:
    """Those that were built."""
    built: list[Learner] = []

    def build(config: Nothing) -> Learner:
        built.append(Learner(config))
        return built[-1]

    outputs = frozenset({"images", "score"})
    spec: DefenseSpec[Any] = DefenseSpec(
        name="learner", summary="Learns.", config=Nothing, build=build, outputs=outputs,  # type: ignore[arg-type]
        needs_calibration=True, needs_model=True, taps=("stem",),
    )  # fmt: skip
    install(spec, tiny_segmenter)
    return built


def test_an_attack_looks_through_what_has_learnt(small: Small, learner: list[Learner], tmp_path: Path) -> None:
    asked: dict[str, Any] = {
        "model": "tiny_segmenter", "attack": "square", "queries": 12, "settings": ["height_px=12", "width_px=24"],
    }  # fmt: skip
    with pytest.raises(GearError, match="give --calibration DIR"):
        attack(small(), out=tmp_path / "no", defense="learner", **asked)
    with pytest.raises(GearError, match="is the twin of clean pictures"):
        attack(small(), out=tmp_path / "no", defense="learner", calibration_patched=small(split="val"), **asked)
    assert not learner and not (tmp_path / "no").exists()
    plain = attack(small(), out=tmp_path / "plain", **asked)
    aware = attack(small(), out=tmp_path / "aware", defense="learner", calibration=small(split="val"), **asked)
    assert learner[0].fits == [(2, 0)]
    assert aware.facts["calibration"] == [gear.open_dataset(small(split="val")).plan.content_key, None]
    assert "calibration" not in plain.facts
    assert not np.array_equal(plain.patches[0].rgb, aware.patches[0].rgb)


class Dimmer(Learner):
    """Leaves the share of all light that it has learnt."""

    def apply(self, views: Any, model: Any, state: float, rng: np.random.Generator) -> DefenseResult:
        dimmed = {name: np.rint(one * (state / 255)).astype(np.uint8) for name, one in views.items()}
        return DefenseResult(views=dimmed, score=0.0)

    def forward_fitted(self, views: Any, model: Any, state: float) -> Any:
        assert "stem" in model.taps()
        return {name: one * (state / 255) for name, one in views.items()}


def test_gradients_pass_what_has_learnt(small: Small, install: Install, tmp_path: Path) -> None:
    dimmer = Dimmer(Nothing())
    spec: DefenseSpec[Any] = DefenseSpec(
        name="dimmer", summary="Dims.", config=Nothing, build=lambda config: dimmer, needs_calibration=True,
        outputs=frozenset({"images", "score"}), needs_model=True, gradient="differentiable",
    )  # fmt: skip
    install(spec, tiny_segmenter)
    asked: dict[str, Any] = {
        "model": "tiny_segmenter", "attack": "scene_specific", "steps": 3,
        "settings": ["height_px=12", "width_px=24"],
    }  # fmt: skip
    plain = attack(small(), out=tmp_path / "plain", **asked)
    aware = attack(small(), out=tmp_path / "aware", defense="dimmer", calibration=small(split="val"), **asked)
    assert dimmer.fits == [(2, 0)], "it learns once"
    assert not np.array_equal(plain.patches[0].rgb, aware.patches[0].rgb)


def test_a_gap_stands_behind_what_has_learnt(small: Small, learner: list[Learner], tmp_path: Path) -> None:
    asked: dict[str, Any] = {
        "patch": "random", "out": tmp_path / "gap", "model": "tiny_segmenter", "defense": "learner", "samples": 1,
        "compositors": ("transport",), "town": TINY_TOWN, "scenes": TINY_SCENES,
    }  # fmt: skip
    with pytest.raises(GearError, match="give --calibration DIR"):
        gear.gap(small(), **asked)
    report = gear.gap(small(), calibration=small(split="val"), calibration_patched=small(split="val"), **asked)
    assert learner[0].fits == [(2, 2)] and report.defense == "learner"
    with pytest.raises(GearError, match="a defense guards a model"):
        gear.gap(small(), twin=tmp_path / "gap/twin", defense="learner", calibration=small(split="val"))
    with pytest.raises(GearError, match="there is no defense: name one with --defense"):
        gear.gap(small(), twin=tmp_path / "gap/twin", calibration=small(split="val"))


def test_a_patch_is_checked_behind_the_defense_that_it_was_made_through(
    small: Small, learner: list[Learner], tmp_path: Path
) -> None:
    """What a defense draws while it learns comes of the attack's seed there, too."""
    behind: dict[str, Any] = {"defense": "learner", "calibration": small(split="val")}
    attack(
        small(), model="tiny_segmenter", out=tmp_path / "p", attack="square", queries=4, seed=5,
        settings=["height_px=12", "width_px=24"], **behind,
    )  # fmt: skip
    verified(
        tmp_path / "p", small(split="val", seed=5), models=["tiny_segmenter"], samples=1, town=TINY_TOWN,
        scenes=f"{TINY_SCENES}:board", **behind,
    )  # fmt: skip
    twin = next((tmp_path / "p").glob("verify/*/tiny_segmenter/twin"))
    report = gear.gap(small(split="val", seed=5), twin=twin, model="tiny_segmenter", samples=1, **behind)
    drawn = [one.drawn for one in learner if one.drawn]
    assert len(drawn) == 3 and drawn[0] == drawn[1] != drawn[2] and report.as_json()["seed"] == 0


def test_attacks_and_gaps_warn_of_a_doubtful_calibration(
    small: Small, copy_small: Copy, learner: list[Learner], tmp_path: Path
) -> None:
    patched, told = tmp_path / "patched", list[str]()
    copy_small("semseg", patched, split="val", patch="random")
    behind: dict[str, Any] = {"defense": "learner", "calibration": patched, "on_warning": told.append}
    attack(
        small(), model="tiny_segmenter", out=tmp_path / "p", attack="square", queries=4,
        settings=["height_px=12", "width_px=24"], **behind,
    )  # fmt: skip
    assert len(told) == 1 and "shows the patch random, but the defense uses its pictures as clean" in told.pop()
    gear.gap(small(split="val"), twin=patched, model="tiny_segmenter", compositors=("transport",), **behind)
    assert len(told) == 2 and "pictures as clean" in told[0] and "learnt from scenes that it is measured on" in told[1]


def test_what_learnt_from_more_samples_is_another_defense(small: Small, learner: list[Learner], tmp_path: Path) -> None:
    whole = small(split="val")
    fewer = shutil.copytree(whole, tmp_path / "fewer")
    (path,) = fewer.glob("gear/*/manifest.json")
    manifest = json.loads(path.read_text())
    path.write_text(json.dumps(manifest | {"samples": manifest["samples"][:1]}))
    plan = path.with_name("plan.json")
    plan.write_text(json.dumps(json.loads(plan.read_text()) | {"samples": 1}))
    facts: dict[str, Any] = {"model": "tiny_segmenter", "defense": "learner"}
    evaluate(small(), calibration=fewer, out=tmp_path / "metrics", **facts)
    with pytest.raises(GearError, match=r"something else \(calibration_samples.*1.*2.*use another --out"):
        evaluate(small(), calibration=whole, out=tmp_path / "metrics", **facts)
    facts |= {"attack": "square", "queries": 4, "settings": ["height_px=12", "width_px=24"]}
    attack(small(), calibration=fewer, out=tmp_path / "patches", **facts)
    with pytest.raises(GearError, match=r"made with other settings \(calibration_samples"):
        attack(small(), calibration=whole, out=tmp_path / "patches", **facts)


def test_learning_from_what_is_measured_is_noted(small: Small, learner: list[Learner], tmp_path: Path) -> None:
    asked: dict[str, Any] = {"model": "tiny_segmenter", "defense": "learner"}
    read: list[tuple[int, int]] = []
    same = evaluate(
        small(), calibration=small(), out=tmp_path / "same", on_fit_progress=lambda *done: read.append(done), **asked
    )
    assert read == [(1, 2), (2, 2)]
    assert evaluate(small(), calibration=small(), out=tmp_path / "same", **asked).facts == same.facts
    assert [len(one.fits) for one in learner] == [1, 0], "what is finished needs no learning"
    assert any("learnt from scenes that it is measured on" in note for note in same.facts["notes"])
    other = evaluate(small(), calibration=small(split="val"), out=tmp_path / "other", **asked)
    assert not any("learnt" in note for note in other.facts["notes"])


def test_swapped_calibration_datasets_give_a_warning(
    small: Small, copy_small: Copy, learner: list[Learner], tmp_path: Path
) -> None:
    clean, patched = small(split="val"), tmp_path / "patched"
    copy_small("semseg", patched, split="val", patch="random")
    asked: dict[str, Any] = {"model": "tiny_segmenter", "defense": "learner"}
    with pytest.raises(GearError, match="--calibration and --calibration-patched are swapped"):
        evaluate(small(), calibration=patched, calibration_patched=clean, out=tmp_path / "out", **asked)
    assert not learner and not (tmp_path / "out").exists()
    right = evaluate(small(), calibration=clean, calibration_patched=patched, out=tmp_path / "right", **asked)
    assert not any("uses its pictures as clean" in note or "no twin" in note for note in right.facts["notes"])
    bold = evaluate(small(), calibration=patched, calibration_patched=patched, out=tmp_path / "bold", **asked)
    assert any("shows the patch random, but the defense" in one for one in bold.facts["notes"])
    other = tmp_path / "other"
    copy_small("semseg", other, split="val", patch="random", seed=5)
    mixed = evaluate(small(), calibration=clean, calibration_patched=other, out=tmp_path / "mixed", **asked)
    assert any(f"{other}: is no twin of {clean}" in one for one in mixed.facts["notes"])
