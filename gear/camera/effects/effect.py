"""The base class `Effect` of camera effects, and the data that effects receive."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import numpy.typing as npt

from gear.contracts.rendering import RawView
from gear.values.frames import FloatImage, GeomTable
from gear.values.geometry import Array
from gear.values.scene import CameraRecord, SceneRecord

if TYPE_CHECKING:
    from torch import Tensor

Pixels = npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Exposure:
    """Everything besides the pixels that an effect may use: the camera and the scene of one picture.

    Attributes:
        camera: the camera that takes the picture.
        scene: the scene, for its seed, its index and the ego car's velocity.
        geoms: table that says what each geom id is; None where it is not known, as when patches are put into stored
            pictures.
    """

    camera: CameraRecord
    scene: SceneRecord
    geoms: GeomTable | None = None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PixelMap:
    """For each pixel of a picture with an effect: the position in the picture without the effect that it shows.

    Attributes:
        x, y: (H, W) float32 column and row in the picture without the effect, index pixels.
        forward: the inverse map: takes (..., 2) float64 index pixels (x, y) without the effect to index pixels with it.
            It is also defined for points outside the picture.
    """

    x: FloatImage
    y: FloatImage
    forward: Callable[[Array], Array]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PixelSamples:
    """N output pixels as weighted means of S input pixels each.

    Attributes:
        x, y: (N, S) float64 columns and rows in the input, index pixels; values between pixels are allowed.
        weight: (N, S) float64 weights.
        inverse_depth: function from (N, S) x and y to the inverse of planar depth there, in a unit that the caller
            chooses. Values of 0 and below mean behind the camera or infinitely far.
    """

    x: Array
    y: Array
    weight: Array
    inverse_depth: Callable[[Array, Array], Array]


class Effect(ABC):
    """Base class of an optional effect of the camera on linear light, such as motion blur.

    A subclass is a frozen dataclass in a module of this folder; gear finds it without a list. Its fields are the
    effect's parameters and become keys of the config's `camera` section. Each field has a default with which the effect
    does nothing, a name that no other effect uses, and a line in the docstring's `Attributes:`. `__post_init__` raises
    `gear.values.errors.FieldError` for values out of range.

    Attributes:
        ORDER: effects are applied by increasing order, from the scene to the sensor.
        MOVES_PIXELS: whether depth and ids move together with the colours. Ground truth then follows `pixel_map`. At
            most one effect may do so.
        IS_LINEAR: whether the output is linear in the input's light. The probes of a dataset include linear effects.
            The compositor applies the other effects with `torch_at`, so these must have a higher order than all linear
            effects.
    """

    __slots__ = ()
    ORDER: ClassVar[int]
    MOVES_PIXELS: ClassVar[bool] = False
    IS_LINEAR: ClassVar[bool] = True

    @property
    @abstractmethod
    def is_active(self) -> bool:
        """Whether the parameters switch the effect on."""

    @abstractmethod
    def apply(self, view: RawView, exposure: Exposure) -> RawView:
        """The view with the effect: colour always, depth and ids if `MOVES_PIXELS`. The input is not changed.

        Args:
            view: linear colour (never None), depth and ids, after the effects of lower order.
            exposure: camera and scene.
        """

    @abstractmethod
    def apply_torch(self, light: Tensor, truth: RawView, exposure: Exposure) -> Tensor:
        """The same as `apply` for colour, in torch: differentiable and without rounding.

        Implementations call only methods of the tensors, so that this module can be imported without torch.

        Args:
            light: (B, 3, H, W) float, linear, 1.0 is full scale; B versions of one picture.
            truth: depth and ids of that picture; its colour is not used.
            exposure: camera and scene.

        Returns:
            (B, 3, H, W) with the dtype and device of `light`.
        """

    def torch_at(self, pixels: tuple[Pixels, Pixels], exposure: Exposure, like: Tensor) -> Callable[[Tensor], Tensor]:
        """The effect on selected pixels, for effects that are not linear and treat each pixel independently.

        Args:
            pixels: (N,) rows and (N,) columns.
            exposure: camera and scene.
            like: tensor whose dtype and device the result uses.

        Returns:
            A differentiable function from (N, 3) linear light of these pixels (1.0 is full scale) to (N, 3) light with
            the effect.

        Raises:
            NotImplementedError: the effect is linear, or a pixel depends on other pixels.
        """
        raise NotImplementedError(f"{type(self).__name__} has no twin on single pixels")

    def trace(self, samples: PixelSamples, exposure: Exposure) -> PixelSamples:
        """Replaces samples of the effect's output by samples of its input.

        The default returns `samples` unchanged, which is right for effects that only scale a pixel's light or add to
        it.

        Args:
            samples: pixels of the effect's output.
            exposure: camera and scene.
        """
        return samples

    def check(self, camera: CameraRecord) -> None:
        """Checks that the parameters fit a camera; the default accepts all.

        Raises:
            FieldError: a parameter does not fit; the message names it.
        """
        return

    def recorded(self, camera: CameraRecord) -> CameraRecord:
        """The camera's record with everything that `from_record` needs to restore the effect; unchanged by default."""
        return camera

    @classmethod
    def from_record(cls, camera: CameraRecord) -> Effect | None:
        """The effect that a camera's record describes, for effects with `MOVES_PIXELS`; None if the record has
        no such effect.
        """
        return None

    def pixel_map(self, camera: CameraRecord) -> PixelMap:
        """The map of pixels, for effects with `MOVES_PIXELS`.

        Raises:
            NotImplementedError: the effect does not move pixels.
        """
        raise NotImplementedError(f"{type(self).__name__} moves no pixels")
