"""Options that every network of gear's has. No torch here: specs are cheap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gear.values.errors import FieldError

SHIPPED = "shipped"
NONE = "none"

CIRCUMSTANCES = ("weights", "device", "precision", "seed")
"""Options that say nothing of how weights are to be used."""


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


LARGEST_SCALE = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmentationOptions(NetworkOptions):
    """Options of networks that label pixels.

    Attributes:
        input_scale: the network runs at this share of the picture's width and height, and its logits are interpolated
            to the picture's size. null takes what the weights were trained for, or 1 where they do not say.
        auxiliary: whether the graph has the heads that only training looks at, as the published files do.
    """

    input_scale: float | None = None
    auxiliary: bool = True

    def __post_init__(self) -> None:
        if self.input_scale is not None and not 0 < self.input_scale <= LARGEST_SCALE:
            raise FieldError("input_scale", f"must be above 0 and at most {LARGEST_SCALE:g}, got {self.input_scale:g}")
