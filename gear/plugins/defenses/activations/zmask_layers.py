"""The inputs of Z-Mask: the layers of a network that are read, and the pictures of a camera rig."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from torch import Tensor

from gear.contracts.models import Model
from gear.values.errors import GearError
from gear.values.frames import UInt8Image

Views = Mapping[str, UInt8Image]
Shown = TypeVar("Shown", UInt8Image, Tensor)
"""Type of pictures: one (H, W, 3) uint8 picture, or a (B, 3, H, W) tensor."""

LEFT, RIGHT = "left", "right"


@dataclass(frozen=True, slots=True, kw_only=True)
class Layers:
    """The feature maps that Z-Mask reads.

    Attributes:
        shallow, deep: names of the taps (layers) with shallow and with deep feature maps.
    """

    shallow: tuple[str, ...]
    deep: tuple[str, ...]

    def all(self) -> tuple[str, ...]:
        """Names of all taps that are read, each once."""
        return tuple(dict.fromkeys((*self.shallow, *self.deep)))


KNOWN = (
    Layers(shallow=("rbb2", "rbb1", "rb1", "rb2"), deep=("rbb2", "rbb1")),
    Layers(shallow=("spatial_1x1", "spatial_7x7", "ct2"), deep=("ct1", "ct2", "spatial_1x1")),
    Layers(shallow=("layer1",), deep=("layer1", "layer4")),
)
"""Default layers of known networks: the published layers, for ResNets only those among gear's taps."""


def layers_of(model: Model, shallow: Sequence[str], deep: Sequence[str]) -> Layers:
    """The layers that Z-Mask reads: those in the arguments, otherwise the published ones, otherwise first and last tap.

    Args:
        model: the network; its taps are the layers that can be read.
        shallow, deep: names of the layers; empty for the default.

    Raises:
        GearError: the model has no taps.
    """
    names = tuple(model.taps())
    if not names:
        raise GearError("Z-Mask reads feature maps, but the model has no taps")
    default = next((known for known in KNOWN if set(known.all()) <= set(names)), None)
    default = default or Layers(shallow=names[:1], deep=tuple(dict.fromkeys((names[0], names[-1]))))
    return Layers(shallow=tuple(shallow) or default.shallow, deep=tuple(deep) or default.deep)


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkInput(Generic[Shown]):
    """One input of the network, made from the pictures of a sample or of a batch.

    Attributes:
        camera: name of the camera whose picture the network's feature maps describe.
        views: pictures for the network, by camera name.
        is_mirrored: whether the pictures are mirrored, left to right.
    """

    camera: str
    views: Mapping[str, Shown]
    is_mirrored: bool


def network_inputs(views: Mapping[str, Shown]) -> tuple[NetworkInput[Shown], ...]:
    """Builds the network inputs in which Z-Mask searches each camera's picture for patches.

    Args:
        views: pictures of one sample ((H, W, 3) uint8) or of a batch ((B, 3, H, W) float in 0..1), by camera name.

    Returns:
        The pictures as they are, as one input. For a stereo rig a second input follows: the mirrored pair with left and
        right exchanged, because the feature maps of a stereo network describe only the left picture. For other rigs
        only the first camera is described.
    """
    first = LEFT if LEFT in views else next(iter(views))
    plain = NetworkInput(camera=first, views=views, is_mirrored=False)
    if set(views) != {LEFT, RIGHT}:
        return (plain,)
    swapped = {one: _mirrored(views[other]) for one, other in ((LEFT, RIGHT), (RIGHT, LEFT))}
    return (plain, NetworkInput(camera=RIGHT, views=swapped, is_mirrored=True))


def _mirrored(picture: Shown) -> Shown:
    return picture.flip(3) if isinstance(picture, Tensor) else np.ascontiguousarray(picture[:, ::-1])
