"""The model protocol. torch appears in types alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor, nn


class Model(Protocol):
    """A network behind one face."""

    def predict(self, views: Mapping[str, UInt8Image]) -> Any:
        """The task's prediction for one sample.

        (H, W, 3) uint8 sRGB pictures by camera name. Never sees ground truth.
        """
        ...

    def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
        """Outputs of a batch, or losses where `targets` are given.

        `views` holds (B, 3, H, W) float pictures in 0..1 by camera name; everything is differentiable to them.
        """
        ...

    def taps(self) -> Mapping[str, nn.Module]:
        """Modules whose outputs are the named feature maps."""
        ...
