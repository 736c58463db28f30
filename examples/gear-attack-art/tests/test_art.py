"""Every promise of an attack, and what this one is for."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
import pytest
from gear.testing.attack_contract import AttackContract
from gear.values.errors import FieldError

from gear_attack_art import ArtConfig, spec

SMALL: dict[str, Any] = {"height_px": 16, "width_px": 32}


class TestArt(AttackContract):
    spec = spec
    options: ClassVar[dict[str, Any]] = SMALL


class TestMomentumOnDepth(AttackContract):
    spec = spec
    options: ClassVar[dict[str, Any]] = SMALL | {"method": "mim"}
    task = "depth"

    def test_the_numbers_of_others_are_not_touched(self) -> None:
        np.random.seed(3)  # noqa: NPY002 - the global generator is what is looked at
        expected = np.random.random()  # noqa: NPY002
        np.random.seed(3)  # noqa: NPY002
        self.attack(self.model(), self.dataset())
        assert np.random.random() == expected  # noqa: NPY002


class TestLimited(AttackContract):
    spec = spec
    options: ClassVar[dict[str, Any]] = SMALL | {"eps_unit": 0.2}

    def test_no_value_moves_too_far(self) -> None:
        short = self.attack(self.model(), self.dataset(), steps=1)
        long = self.attack(self.model(), self.dataset(), steps=12)
        assert float(np.abs(short[0].rgb - long[0].rgb).max()) <= 0.25 + 1e-5


def test_absurd_options_are_refused() -> None:
    with pytest.raises(FieldError, match="batch"):
        ArtConfig(batch=0)
