"""Options of all of gear's networks. torch is not imported, so that specs are quick to make."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gear.values.errors import FieldError

SHIPPED = "shipped"
NONE = "none"

CIRCUMSTANCES = ("weights", "device", "precision", "seed")
"""Options that do not affect how weights are used, such as the device."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkOptions:
    """Source of the weights, device and precision.

    Attributes:
        weights: `shipped` for the reference weights of the package mujoco-gear-weights, `none` for random ones from
            `seed`, or the path of a safetensors file (`gear weights convert` makes one of a published file).
        device: `auto` takes a GPU where there is one.
        precision: `bfloat16` runs suitable operations at half precision, which is faster and accurate enough to
            optimise patches; reported metrics use `float32`.
        seed: of random weights.
    """

    weights: str = SHIPPED
    device: Literal["auto", "cpu", "cuda"] = "auto"
    precision: Literal["float32", "bfloat16"] = "float32"
    seed: int = 0


LARGEST_SCALE = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SegmentationOptions(NetworkOptions):
    """Options of networks for semantic segmentation.

    Attributes:
        input_scale: factor by which pictures are resized before the network; logits are interpolated to the picture's
            size. null takes the factor that the weights were trained for, or 1 where they state none.
        auxiliary: whether the graph has the heads that are used in training alone, as published files do.
    """

    input_scale: float | None = None
    auxiliary: bool = True

    def __post_init__(self) -> None:
        if self.input_scale is not None and not 0 < self.input_scale <= LARGEST_SCALE:
            raise FieldError("input_scale", f"must be above 0 and at most {LARGEST_SCALE:g}, got {self.input_scale:g}")
