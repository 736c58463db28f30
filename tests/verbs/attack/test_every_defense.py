"""Every installed defense either passes a gradient to adaptive attacks, or is refused in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gear.contracts.specs import DefenseSpec
from gear.plugins.build import find
from gear.plugins.manager import catalogue
from gear.testing.tiny_networks import tiny_segmenter
from gear.values.errors import GearError
from gear.verbs.attack.run import attack
from tests.verbs.attack.conftest import SMALL
from tests.verbs.conftest import Collected, Install, Small

QUICK: dict[str, list[str]] = {
    "nutnet": ["steps=20"], "sac": ["steps=20", "filters=4"], "hyperneuron": ["false_alarms=0.2"],
    "fpda": ["false_alarms=0.2"], "zmask": ["false_alarms=0.2"],
}  # fmt: skip
"""Options with which calibrations are short; eight pictures set no threshold that one in twenty exceeds."""

SEMSEG = [
    name for name in catalogue().names("defense")
    if "/" not in name and (not (tasks := find("defense", name).spec.tasks) or "semseg" in tasks)
]  # fmt: skip
"""Defenses that protect networks for semantic segmentation."""


@pytest.mark.slow
@pytest.mark.parametrize("defense", SEMSEG)
def test_an_adaptive_attack_has_a_gradient_or_is_refused(
    defense: str, small: Small, collected: Collected, install: Install, tmp_path: Path
) -> None:
    install(tiny_segmenter)
    spec = find("defense", defense).spec
    assert isinstance(spec, DefenseSpec)
    asked: dict[str, Any] = {"model": "tiny_segmenter", "steps": 1, "settings": SMALL, "defense": defense}
    asked["defense_settings"] = QUICK.get(defense, [])
    if spec.needs_calibration:
        clean = collected("semseg", "calibration", scene="board", split="val", samples=8)
        asked["calibration"] = clean
        if spec.name not in ("hyperneuron", "fpda"):
            asked["calibration_patched"] = collected(
                "semseg", "calibration-patched", scene="board", split="val", samples=8, patch="random"
            )
    if spec.gradient == "none":
        with pytest.raises(GearError, match="--attack square") as refused:
            attack(small(), out=tmp_path / "out", **asked)
        assert "\n" not in str(refused.value)
        return
    aware = attack(small(), out=tmp_path / "aware", **asked)
    plain = attack(small(), out=tmp_path / "plain", model="tiny_segmenter", steps=1, settings=SMALL)
    assert all(size > 0 for size in aware.facts["curves"]["gradient"])
    assert not np.array_equal(aware.patches[0].rgb, plain.patches[0].rgb), "the defense changes the patch"


@pytest.mark.slow
def test_an_attack_on_a_detector_behind_object_seeker_has_a_gradient(small: Small, tmp_path: Path) -> None:
    asked: dict[str, Any] = {
        "model": "retinanet_lite0_fpn", "model_settings": ["weights=none", "input_scale=0.4"], "steps": 1,
        "settings": SMALL,
    }  # fmt: skip
    aware = attack(small("detect2d"), out=tmp_path / "aware", defense="object_seeker", **asked)
    plain = attack(small("detect2d"), out=tmp_path / "plain", **asked)
    assert all(size > 0 for size in aware.facts["curves"]["gradient"])
    assert not np.array_equal(aware.patches[0].rgb, plain.patches[0].rgb), "the defense changes the patch"
