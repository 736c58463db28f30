"""Options that every network of gear's has. No torch here: specs are cheap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

SHIPPED = "shipped"
NONE = "none"


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkOptions:
    """Where the weights come from and where the network runs.

    Attributes:
        weights: `shipped` are the reference weights of the package mujoco-gear-weights, `none` are random ones from
            `seed`; anything else is the path of a safetensors file (gear weights convert makes one of a published
            file).
        device: `auto` takes a GPU where there is one.
        precision: `bfloat16` runs what may be run so at half the precision: faster, and good enough to optimise
            patches with; scores are reported in `float32`.
        seed: of random weights.
    """

    weights: str = SHIPPED
    device: Literal["auto", "cpu", "cuda"] = "auto"
    precision: Literal["float32", "bfloat16"] = "float32"
    seed: int = 0
