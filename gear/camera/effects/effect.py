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
    """The camera and the scene of one picture: the data, besides pixels, that a camera effect may use.

    Attributes:
        camera: the camera that takes the picture.
        scene: the scene, for its seed, its index and the ego car's velocity.
        geoms: label and object of each geom id; None if they are not known, as when patches are composed into stored
            pictures.
    """

    camera: CameraRecord
    scene: SceneRecord
    geoms: GeomTable | None = None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PixelMap:
    """The mapping of pixels by an effect that moves pixels, such as lens distortion. Positions are in index pixels.

    Attributes:
        x, y: (H, W) float32 column and row in the picture without the effect, for each pixel of the picture with the
            effect.
        forward: the inverse mapping, a function from (..., 2) float64 positions (x, y) without the effect to positions
            with the effect. It is also defined for points outside the picture.
    """

    x: FloatImage
    y: FloatImage
    forward: Callable[[Array], Array]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PixelSamples:
    """N output pixels of an effect, each as a weighted mean of S pixels of its input.

    Attributes:
        x, y: (N, S) float64 columns and rows in the input, index pixels; values between pixels are allowed.
        weight: (N, S) float64 weights.
        inverse_depth: function from (N, S) x and y to 1 / depth (planar) at these positions, in a unit that the caller
            chooses. A value of 0 or less means a point behind the camera or at infinity.
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
        MOVES_PIXELS: whether the effect moves pixels, with their depth and ids. Ground truth then follows `pixel_map`.
            At most one effect may move pixels.
        IS_LINEAR: whether the output is linear in the input's light. The probes of a dataset (samples rendered with
            black and white surfaces) include linear effects. When a patch is composed into a sample, the effects that
            are not linear are applied with `torch_at`, so they must have a higher order than all linear effects.
    """

    __slots__ = ()
    ORDER: ClassVar[int]
    MOVES_PIXELS: ClassVar[bool] = False
    IS_LINEAR: ClassVar[bool] = True

    @property
    @abstractmethod
    def is_active(self) -> bool:
        """Whether the effect is on: its parameters change the picture."""

    @abstractmethod
    def apply(self, view: RawView, exposure: Exposure) -> RawView:
        """Applies the effect to a view.

        Args:
            view: linear colour (never None), depth and ids, after the effects of lower order.
            exposure: camera and scene.

        Returns:
            A new view. Its colour is changed; depth and ids are changed only by effects with `MOVES_PIXELS`.
        """

    @abstractmethod
    def apply_torch(self, light: Tensor, truth: RawView, exposure: Exposure) -> Tensor:
        """Applies the effect to the colour of pictures in torch: differentiable and without rounding.

        Implementations call only methods of the tensors, so that this module can be imported without torch.

        Args:
            light: (B, 3, H, W) float, linear, 1.0 is full scale; B versions of one picture.
            truth: depth and ids of that picture; its colour is not used.
            exposure: camera and scene.

        Returns:
            (B, 3, H, W) linear light with the effect, with the dtype and device of `light`.
        """

    def torch_at(self, pixels: tuple[Pixels, Pixels], exposure: Exposure, like: Tensor) -> Callable[[Tensor], Tensor]:
        """The effect on selected pixels, as a function in torch. It is defined for effects that are not linear and
        treat each pixel independently.

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
        """Replaces each sample of the effect's output by the weighted samples of its input from which it is computed.

        The default returns `samples` unchanged, which is right for effects that only scale a pixel's light or add to
        it.

        Args:
            samples: pixels of the effect's output.
            exposure: camera and scene.
        """
        return samples

    def check(self, camera: CameraRecord) -> None:
        """Checks that the effect's parameters are valid for a camera. The default implementation accepts every
        camera.

        Args:
            camera: the camera, for its size and intrinsics.

        Raises:
            FieldError: a parameter is not valid; the message names it.
        """
        return

    def recorded(self, camera: CameraRecord) -> CameraRecord:
        """Returns the camera's record, completed with the parameters of the effect, so that `from_record` can
        restore it.

        The default returns the record unchanged, for effects that do not move pixels.

        Args:
            camera: record of the camera without the effect.
        """
        return camera

    @classmethod
    def from_record(cls, camera: CameraRecord) -> Effect | None:
        """Restores the effect from a camera's record, for effects with `MOVES_PIXELS`; None if the record has no
        such effect.

        Args:
            camera: record of a camera that `recorded` completed.
        """
        return None

    def pixel_map(self, camera: CameraRecord) -> PixelMap:
        """Returns the mapping between the pixels with and without the effect, for effects with `MOVES_PIXELS`.

        Args:
            camera: the camera, for its size and pinhole intrinsics.

        Raises:
            NotImplementedError: the effect does not move pixels.
        """
        raise NotImplementedError(f"{type(self).__name__} moves no pixels")
