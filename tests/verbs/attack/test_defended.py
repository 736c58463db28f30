"""`gear attack` through a defense: one that cleans pictures, one that wraps the model."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gear.testing.tiny_networks import tiny_segmenter
from gear.verbs.attack.run import attack
from tests.verbs.attack.conftest import SMALL, wrapping
from tests.verbs.conftest import Install, Small


def test_a_defense_is_looked_through(small: Small, install: Install, tmp_path: Path) -> None:
    plain = attack(small(), model="tiny_segmenter", out=tmp_path / "plain", steps=2, settings=SMALL)
    aware = attack(small(), model="tiny_segmenter", out=tmp_path / "aware", steps=2, settings=SMALL, defense="gaussian")
    assert aware.facts["defense"]["name"] == "gaussian"
    assert not np.array_equal(plain.patches[0].rgb, aware.patches[0].rgb)


def test_a_defense_around_the_model_is_looked_through(small: Small, install: Install, tmp_path: Path) -> None:
    """As gear evaluate has it, whose metrics the attack is for."""
    install(tiny_segmenter, wrapping)
    facts: dict[str, Any] = {"model": "tiny_segmenter", "steps": 2, "settings": SMALL}
    plain = attack(small(), out=tmp_path / "plain", **facts)
    aware = attack(small(), out=tmp_path / "aware", defense="wrapping", **facts)
    assert not np.array_equal(plain.patches[0].rgb, aware.patches[0].rgb)
    assert aware.facts["weights_sha256"] is not None, "what is wrapped is hashed"
