"""What a camera effect is: one class in one file of this folder, its parameters and all that is computed from them."""

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
    """One picture that is being taken.

    Attributes:
        camera: the camera that takes it.
        scene: the scene, for its seed, its index and the ego car's velocity.
        geoms: what each geom id is; None where that is not known, as when patches are put into stored pictures.
    """

    camera: CameraRecord
    scene: SceneRecord
    geoms: GeomTable | None = None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PixelMap:
    """Where the pixels of a picture with an effect come from in the picture without it.

    Attributes:
        x, y: (H, W) float32 column and row in the picture without the effect, index pixels.
        forward: the opposite way: (..., 2) float64 index pixels (x, y) without the effect to those with it. It is
            defined for points outside of the picture as well.
    """

    x: FloatImage
    y: FloatImage
    forward: Callable[[Array], Array]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PixelSamples:
    """The pixels that N output pixels are weighted means of, S each.

    Attributes:
        x, y: (N, S) float64 index pixels of the input, between pixels as well.
        weight: (N, S) float64.
        inverse_depth: takes (N, S) x and y to the inverse of planar depth there, in a unit that the caller chooses;
            0 and less is behind the camera or endlessly far.
    """

    x: Array
    y: Array
    weight: Array
    inverse_depth: Callable[[Array, Array], Array]


class Effect(ABC):
    """An optional effect of the camera on linear light.

    A subclass is a frozen dataclass: its fields are the effect's parameters, and become keys of the config's `camera`
    section. Each field has a default with which the effect does nothing, a name that no other effect uses, and a line
    in the docstring's `Attributes:`. `__post_init__` raises `gear.values.errors.FieldError` for values out of range.
    A subclass in a module of this folder is found without being listed anywhere.

    Attributes:
        ORDER: effects are applied by growing order: the way of the light through the camera.
        MOVES_PIXELS: whether depth and ids move with the colours. Ground truth then follows `pixel_map`. At most one
            effect may do so.
        IS_LINEAR: whether the output is linear in the input's light. Linear effects are in the compositor's probes; it
            applies the others again, by `torch_at`. So those have a higher order than all linear ones.
    """

    __slots__ = ()
    ORDER: ClassVar[int]
    MOVES_PIXELS: ClassVar[bool] = False
    IS_LINEAR: ClassVar[bool] = True

    @property
    @abstractmethod
    def is_active(self) -> bool:
        """Whether the parameters ask for any effect."""

    @abstractmethod
    def apply(self, view: RawView, exposure: Exposure) -> RawView:
        """The view with the effect: colour always, depth and ids where `MOVES_PIXELS`. The input is not changed.

        Args:
            view: linear colour (not None), depth and ids, as the renderer and the effects of lower order leave them.
            exposure: camera and scene.
        """

    @abstractmethod
    def apply_torch(self, light: Tensor, truth: RawView, exposure: Exposure) -> Tensor:
        """The torch twin of `apply` for colour: differentiable, without rounding.

        It calls methods of tensors only, so that this module can be imported without torch.

        Args:
            light: (B, 3, H, W) float, linear, 1.0 is full scale; several versions of one picture.
            truth: depth and ids of the picture; colour is not used.
            exposure: camera and scene.

        Returns:
            (B, 3, H, W) of the same dtype and device.
        """

    def torch_at(self, pixels: tuple[Pixels, Pixels], exposure: Exposure, like: Tensor) -> Callable[[Tensor], Tensor]:
        """The effect on some pixels, for effects that are not linear and change each pixel independently.

        Args:
            pixels: (N,) rows and (N,) columns.
            exposure: camera and scene.
            like: a tensor whose dtype and device are to be used.

        Returns:
            A function of (N, 3) linear light of these pixels, 1.0 is full scale, to the same with the effect;
            differentiable.

        Raises:
            NotImplementedError: the effect is linear, or one pixel depends on others.
        """
        raise NotImplementedError(f"{type(self).__name__} has no twin on single pixels")

    def trace(self, samples: PixelSamples, exposure: Exposure) -> PixelSamples:
        """Which pixels of the effect's input the given pixels of its output are means of; the same by default.

        Effects that only scale or add to a pixel's light leave this as it is.
        """
        return samples

    def check(self, camera: CameraRecord) -> None:
        """Refuses parameters that do not fit a camera; accepts all by default.

        Raises:
            FieldError: names the parameter.
        """
        return

    def recorded(self, camera: CameraRecord) -> CameraRecord:
        """The camera's record with all that `from_record` needs; the same by default."""
        return camera

    @classmethod
    def from_record(cls, camera: CameraRecord) -> Effect | None:
        """The effect that a camera's record holds, for effects with `MOVES_PIXELS`; None where it holds none."""
        return None

    def pixel_map(self, camera: CameraRecord) -> PixelMap:
        """How pixels move, for effects with `MOVES_PIXELS`.

        Raises:
            NotImplementedError: the effect moves none.
        """
        raise NotImplementedError(f"{type(self).__name__} moves no pixels")
