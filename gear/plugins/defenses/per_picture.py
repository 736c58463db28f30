"""The base class of defenses that clean each picture separately: no model, no calibration, no randomness."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gear.contracts.defenses import DefenseResult
from gear.contracts.models import Model
from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor

Mask = npt.NDArray[np.float32]


class PerPicture(ABC):
    """The base class of defenses that clean each picture separately; subclasses define `clean` and `clean_tensor`.

    `clean` is the NumPy version for evaluation, `clean_tensor` the torch version for attacks that need gradients.
    """

    @abstractmethod
    def clean(self, picture: UInt8Image) -> tuple[UInt8Image, Mask | None]:
        """Cleans one picture.

        Args:
            picture: (H, W, 3) uint8 sRGB.

        Returns:
            The cleaned picture as a new array, and the estimated (H, W) mask of the patch in 0..1, or None.
        """

    @abstractmethod
    def clean_tensor(self, pictures: Tensor) -> Tensor:
        """Cleans a batch of pictures, with the gradient that the plugin's spec declares.

        Args:
            pictures: (B, 3, H, W) in 0..1.
        """

    def fit(
        self,
        clean: Sequence[Mapping[str, UInt8Image]],
        patched: Sequence[Mapping[str, UInt8Image]],
        model: Model | None,
        rng: np.random.Generator,
    ) -> None:
        """Does nothing, since these defenses need no calibration.

        Args:
            clean, patched, model, rng: not used.
        """
        return

    def apply(
        self, views: Mapping[str, UInt8Image], model: Model | None, state: Any, rng: np.random.Generator
    ) -> DefenseResult:
        """Cleans the picture of each camera; the score is the largest mean of the masks, None without masks.

        Args:
            views: (H, W, 3) uint8 pictures of the sample by camera name.
            model, state, rng: not used.
        """
        cleaned: dict[str, UInt8Image] = {}
        masks: dict[str, Mask] = {}
        for name, picture in views.items():
            cleaned[name], mask = self.clean(picture)
            if mask is not None:
                masks[name] = mask
        score = max(float(mask.mean()) for mask in masks.values()) if masks else None
        return DefenseResult(views=cleaned, mask=masks or None, score=score)

    def forward(self, views: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the cleaned pictures of each camera, in 0..1.

        Args:
            views: (B, 3, H, W) pictures by camera name, float in 0..1.
        """
        return {name: self.clean_tensor(pictures) for name, pictures in views.items()}

    def wrap(self, model: Model) -> Model:
        """Returns the model unchanged, because these defenses only change pictures.

        Args:
            model: the network to be defended.
        """
        return model


def straight_through(pictures: Tensor, cleaned: Tensor) -> Tensor:
    """Returns the cleaned values with the gradient of the unchanged pictures (BPDA; Athalye et al., ICML 2018).

    Args:
        pictures: the pictures before cleaning, which carry the gradient.
        cleaned: the cleaned pictures, of the same shape.
    """
    return pictures + (cleaned - pictures).detach()


def each_as_uint8(pictures: Tensor, clean: Any) -> Tensor:
    """Applies a NumPy function to every picture of a batch, as bytes; the result has no gradient.

    Args:
        pictures: (B, 3, H, W) in 0..1; they are rounded to bytes.
        clean: function from one (H, W, 3) uint8 picture to another.

    Returns:
        (B, 3, H, W) in 0..1 on the device of `pictures`.
    """
    import torch

    from gear.networks.runtime import as_bytes

    cleaned = np.stack([clean(picture) for picture in as_bytes(pictures)])
    return torch.from_numpy(cleaned).to(pictures).permute(0, 3, 1, 2) / 255
