"""`gear attack` through a defense: one that cleans pictures, one that wraps the model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from gear.contracts.specs import DefenseSpec
from gear.plugins.defenses.per_picture import PerPicture
from gear.testing.tiny_networks import tiny_segmenter
from gear.verbs.attack.run import attack

SMALL = ["height_px=12", "width_px=24", "batch=1"]

Small = Callable[..., Path]
Install = Callable[..., None]


@dataclass(frozen=True, kw_only=True)
class Nothing:
    """No options."""


def test_a_defense_is_looked_through(small: Small, install: Install, tmp_path: Path) -> None:
    plain = attack(small(), model="tiny_segmenter", out=tmp_path / "plain", steps=2, settings=SMALL)
    aware = attack(small(), model="tiny_segmenter", out=tmp_path / "aware", steps=2, settings=SMALL, defense="gaussian")
    assert aware.facts["defense"]["name"] == "gaussian"
    assert not np.array_equal(plain.patches[0].rgb, aware.patches[0].rgb)


class Inverted:
    """A model that is shown negatives."""

    def __init__(self, bare: Any) -> None:
        self.bare = bare

    def predict(self, views: Any) -> Any:
        return self.bare.predict({name: 255 - picture for name, picture in views.items()})

    def forward(self, views: Any, targets: Any = None) -> Any:
        return self.bare.forward({name: 1 - pictures for name, pictures in views.items()}, targets)

    def taps(self) -> Any:
        return {}


class Wrapping(PerPicture):
    """A defense that does all it does around the model."""

    def __init__(self, config: Nothing) -> None:
        pass

    def clean(self, picture: Any) -> Any:
        return picture, None

    def clean_tensor(self, pictures: torch.Tensor) -> torch.Tensor:
        return pictures

    def wrap(self, model: Any) -> Any:
        return Inverted(model)


def test_a_defense_around_the_model_is_looked_through(small: Small, install: Install, tmp_path: Path) -> None:
    """As gear evaluate has it, whose figures the attack is for."""
    wrapping = DefenseSpec(name="wrapping", summary="Wraps.", config=Nothing, build=Wrapping, gradient="differentiable")
    install(tiny_segmenter, wrapping)
    facts: dict[str, Any] = {"model": "tiny_segmenter", "steps": 2, "settings": SMALL}
    plain = attack(small(), out=tmp_path / "plain", **facts)
    aware = attack(small(), out=tmp_path / "aware", defense="wrapping", **facts)
    assert not np.array_equal(plain.patches[0].rgb, aware.patches[0].rgb)
    assert aware.facts["weights_sha256"] is not None, "what is wrapped is hashed"
