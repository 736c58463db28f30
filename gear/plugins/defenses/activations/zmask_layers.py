"""What Z-Mask looks at: which layers, and which pictures of a rig."""

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
"""One picture of (H, W, 3) bytes, or a batch of (B, 3, H, W) numbers."""

LEFT, RIGHT = "left", "right"


@dataclass(frozen=True, slots=True, kw_only=True)
class Layers:
    """Which feature maps are looked at.

    Attributes:
        shallow, deep: names of taps.
    """

    shallow: tuple[str, ...]
    deep: tuple[str, ...]

    def all(self) -> tuple[str, ...]:
        """Each once."""
        return tuple(dict.fromkeys((*self.shallow, *self.deep)))


KNOWN = (
    Layers(shallow=("rbb2", "rbb1", "rb1", "rb2"), deep=("rbb2", "rbb1")),
    Layers(shallow=("spatial_1x1", "spatial_7x7", "ct2"), deep=("ct1", "ct2", "spatial_1x1")),
    Layers(shallow=("layer1",), deep=("layer1", "layer4")),
)
"""Of DDRNet and BiSeNet as the supplement has them; of ResNets as far as their taps go."""


def layers_of(model: Model, shallow: Sequence[str], deep: Sequence[str]) -> Layers:
    """The paper's layers of a network that has them, else the first and the last tap; what is given wins.

    Raises:
        GearError: the model has no taps.
    """
    names = tuple(model.taps())
    if not names:
        raise GearError("Z-Mask looks at feature maps, and the model has none")
    usual = next((known for known in KNOWN if set(known.all()) <= set(names)), None)
    usual = usual or Layers(shallow=names[:1], deep=tuple(dict.fromkeys((names[0], names[-1]))))
    return Layers(shallow=tuple(shallow) or usual.shallow, deep=tuple(deep) or usual.deep)


@dataclass(frozen=True, slots=True, kw_only=True)
class Look(Generic[Shown]):
    """One way to show a sample, or a batch of them, to the network.

    Attributes:
        camera: whose picture its feature maps tell of.
        views: what the network is shown, by camera name.
        is_mirrored: whether that is left and right the wrong way round.
    """

    camera: str
    views: Mapping[str, Shown]
    is_mirrored: bool


def looks(views: Mapping[str, Shown]) -> tuple[Look[Shown], ...]:
    """A look for each camera whose picture the network can be made to tell of, that of the reference camera first.

    A stereo network tells of the left picture. In a mirror the right picture is the left one of another pair, so that
    the same network with the same statistics tells of it, too. Of other rigs the first camera alone is looked at.
    """
    first = LEFT if LEFT in views else next(iter(views))
    plain = Look(camera=first, views=views, is_mirrored=False)
    if set(views) != {LEFT, RIGHT}:
        return (plain,)
    swapped = {one: _mirrored(views[other]) for one, other in ((LEFT, RIGHT), (RIGHT, LEFT))}
    return (plain, Look(camera=RIGHT, views=swapped, is_mirrored=True))


def _mirrored(picture: Shown) -> Shown:
    return picture.flip(3) if isinstance(picture, Tensor) else np.ascontiguousarray(picture[:, ::-1])
