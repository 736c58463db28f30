"""The base class of defenses that locate patches in each picture and then replace the located pixels."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from gear.contracts.defenses import DefendedBatch, DefenseResult
from gear.contracts.models import Model
from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor

Located = npt.NDArray[np.bool_]


class MaskAndFill(ABC):
    """The base class of defenses that treat each picture separately: locate patches, then fill their pixels.

    Subclasses define `locate` and `fill` in NumPy, `locate_tensor`, whose gradient an adaptive attack uses to hide its
    patch, and `fit` of the protocol `Defense`. The score of a sample is the largest share of a picture that is located.
    """

    @abstractmethod
    def locate(self, picture: UInt8Image, state: Any) -> Located:
        """Returns the (H, W) bool mask of the pixels that are taken for a patch.

        Args:
            picture: (H, W, 3) uint8 sRGB; never changed in place.
            state: the result of the calibration; None without calibration.
        """

    @abstractmethod
    def locate_tensor(self, pictures: Tensor, state: Any) -> Tensor:
        """Returns (B, H, W) probabilities in 0..1 that a pixel is located, with a gradient.

        Args:
            pictures: (B, 3, H, W) in 0..1.
            state: the result of the calibration; None without calibration.
        """

    @abstractmethod
    def fill(self, picture: UInt8Image, located: Located) -> UInt8Image:
        """Returns a new picture in which the located pixels are replaced.

        Args:
            picture: (H, W, 3) uint8 sRGB; never changed in place.
            located: (H, W) bool mask of the pixels to replace.
        """

    def apply(
        self, views: Mapping[str, UInt8Image], model: Model | None, state: Any, rng: np.random.Generator
    ) -> DefenseResult:
        """Replaces the located pixels of each camera's picture.

        Args:
            views: (H, W, 3) uint8 pictures of the sample by camera name.
            model, rng: not used.
            state: the result of the calibration; None without calibration.

        Returns:
            The filled pictures, the masks (0 or 1), and as score the largest share of a picture that is located.
        """
        located = {name: self.locate(picture, state) for name, picture in views.items()}
        return DefenseResult(
            views={name: self.fill(picture, located[name]) for name, picture in views.items()},
            mask={name: one.astype(np.float32) for name, one in located.items()},
            score=max(float(one.mean()) for one in located.values()),
        )

    def forward(self, views: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the filled pictures of a defense that is not calibrated.

        Args:
            views: (B, 3, H, W) pictures by camera name, float in 0..1.
        """
        return self._defended(views, None).views

    def forward_fitted(self, views: Mapping[str, Tensor], model: Model, state: Any) -> Mapping[str, Tensor]:
        """Returns the filled pictures of `defend_batch`.

        Args:
            views: (B, 3, H, W) pictures by camera name, float in 0..1.
            model: not used.
            state: the result of the calibration.
        """
        return self._defended(views, state).views

    def defend_batch(self, views: Mapping[str, Tensor], model: Model, state: Any) -> DefendedBatch:
        """Fills pictures as `apply` does, and returns them with masks and scores that have gradients.

        The values are those of `apply`. The gradient of the threshold and of all later changes of the mask is that of
        the mask of `locate_tensor`; the colours that replace the located pixels have none.

        Args:
            views: (B, 3, H, W) pictures by camera name, float in 0..1.
            model: not used.
            state: the result of the calibration.
        """
        return self._defended(views, state)

    def wrap(self, model: Model) -> Model:
        """Returns the model unchanged, because these defenses only change pictures.

        Args:
            model: the network to be defended.
        """
        return model

    def _defended(self, views: Mapping[str, Tensor], state: Any) -> DefendedBatch:
        import torch

        from gear.networks.runtime import as_bytes

        cleaned, masks, shares = {}, {}, []
        for name, pictures in views.items():
            levels = as_bytes(pictures)
            located = [self.locate(picture, state) for picture in levels]
            filled = [self.fill(picture, one) for picture, one in zip(levels, located, strict=True)]
            hard = torch.from_numpy(np.stack(located)).to(pictures)
            soft = self.locate_tensor(pictures, state)
            cover = (hard + soft - soft.detach())[:, None]
            colours = torch.from_numpy(np.stack(filled)).to(pictures).permute(0, 3, 1, 2) / 255
            cleaned[name] = pictures * (1 - cover) + colours * cover
            masks[name] = soft
            shares.append(cover.mean(dim=(1, 2, 3)))
        return DefendedBatch(views=cleaned, masks=masks, scores=torch.stack(shares).amax(dim=0))
