from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import torch

from gear.networks.input_scale import NEGLIGIBLE, input_scale_of, width_share
from gear.networks.weights import write
from gear.values.errors import GearError


@dataclass(frozen=True)
class Options:
    weights: str = "none"
    input_scale: float | None = None


def stated(folder: Path, value: Any) -> Options:
    path = folder / "net.safetensors"
    write(path, {"a": torch.zeros(1)}, {"options": json.dumps({"input_scale": value})})
    return Options(weights=str(path))


def test_the_user_comes_before_the_weights_and_these_before_the_default(tmp_path: Path) -> None:
    of_weights = stated(tmp_path, 0.75)
    assert input_scale_of(Options(of_weights.weights, 0.25), "net", 0.5) == 0.25
    assert input_scale_of(of_weights, "net", 0.5) == 0.75
    assert input_scale_of(Options(), "net", 0.5) == 0.5


@pytest.mark.parametrize("value", [0, -0.5, 9, "half", True, [0.5]])
def test_a_factor_that_is_none_is_refused(tmp_path: Path, value: Any) -> None:
    with pytest.raises(GearError, match=r"net\.safetensors: says input_scale"):
        input_scale_of(stated(tmp_path, value), "net")


@pytest.mark.parametrize(("width_px", "share"), [(1000, 1.0), (1019, 1.0), (1021, 1.021), (500, 0.5), (981, 1.0)])
def test_negligible_differences_of_width_are_none(width_px: int, share: float) -> None:
    assert NEGLIGIBLE == 0.02
    assert width_share(width_px, 1000) == share
