"""Options that every network of gear has. The module does not import torch, so plugin specs load quickly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gear.values.errors import FieldError

SHIPPED = "shipped"
NONE = "none"

CIRCUMSTANCES = ("weights", "device", "precision", "seed")
"""Names of the options that do not change what a network with given weights computes, such as the device."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkOptions:
    """Options of every network: source of the weights, device and precision.

    Attributes:
        weights: `shipped` for the reference weights in the package mujoco-gear-weights, `none` for random weights drawn
            with `seed`, or the path of a safetensors file (`gear weights convert` makes one from a published file).
        device: `auto` takes a GPU if there is one.
        precision: `bfloat16` runs suitable operations in half precision, which is faster and accurate enough to
            optimise patches; reported metrics use `float32`.
        seed: seed of random weights.
    """

    weights: str = SHIPPED
    device: Literal["auto", "cpu", "cuda"] = "auto"
    precision: Literal["float32", "bfloat16"] = "float32"
    seed: int = 0


LARGEST_SCALE = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmentationOptions(NetworkOptions):
    """Options of networks for semantic segmentation. They include the options of `NetworkOptions`.

    Attributes:
        input_scale: factor by which pictures are resized before the network; logits are interpolated to the picture's
            size. null takes the factor with which the weights were trained, or 1 if they state none.
        auxiliary: whether the network has the heads that only training uses; published files contain them.
    """

    input_scale: float | None = None
    auxiliary: bool = True

    def __post_init__(self) -> None:
        if self.input_scale is not None and not 0 < self.input_scale <= LARGEST_SCALE:
            raise FieldError("input_scale", f"must be above 0 and at most {LARGEST_SCALE:g}, got {self.input_scale:g}")
