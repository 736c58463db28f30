"""Radial distortion of a lens, by the model of Brown and Conrady (Brown, "Close-range camera calibration", 1971)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from gear.camera.effects.effect import Effect, Exposure, PixelMap, PixelSamples
from gear.camera.effects.sampling import read_bilinear
from gear.contracts.rendering import RawView
from gear.values.errors import FieldError
from gear.values.frames import FloatImage
from gear.values.geometry import Array, Intrinsics
from gear.values.scene import CameraRecord, LensRecord

if TYPE_CHECKING:
    from torch import Tensor

_NEWTON_STEPS = 12
_LEAST_SLOPE = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class Lens:
    """Coefficients of radial distortion about the principal point.

    A point that a pinhole camera sees at (x, y), in units of its focal length, appears at (x, y) (1 + k1 r² + k2 r⁴)
    with r² = x² + y².

    Attributes:
        k1, k2: coefficients, -0.5 to 0.5. Negative values give barrel distortion, positive values pincushion
            distortion.
    """

    k1: float = 0.0
    k2: float = 0.0

    def __post_init__(self) -> None:
        for name in ("k1", "k2"):
            if not -0.5 <= getattr(self, name) <= 0.5:
                raise FieldError(name, f"must be -0.5 to 0.5, got {getattr(self, name):g}")


@dataclass(frozen=True, slots=True, eq=False)
class LensMap:
    """The position in a pinhole camera's picture of each pixel of a distorted picture.

    Attributes:
        x, y: (H, W) float32 columns and rows in the pinhole picture, index pixels; read-only.
        focal_px: horizontal focal length of the distorted picture in pixels. It is chosen so that no corner stays
            empty.
    """

    x: FloatImage
    y: FloatImage
    focal_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LensDistortion(Effect):
    """Radial lens distortion as a camera effect.

    Colour is resampled bilinearly in linear light; depth and ids are taken from the nearest pixel.

    Attributes:
        lens: coefficients of the distortion.
    """

    ORDER: ClassVar[int] = 20
    MOVES_PIXELS: ClassVar[bool] = True

    lens: Lens = field(default_factory=Lens)

    @property
    def is_active(self) -> bool:
        """Whether the distortion is on: any coefficient differs from 0."""
        return self.lens.k1 != 0 or self.lens.k2 != 0

    def apply(self, view: RawView, exposure: Exposure) -> RawView:
        """Distorts a view: colour is resampled bilinearly and rounded; depth and ids are taken from the nearest
        pixel.

        Args:
            view: view of the pinhole camera, with colour.
            exposure: camera and scene of the picture.
        """
        return distort(view, self.lens, exposure.camera.intrinsics)

    def apply_torch(self, light: Tensor, truth: RawView, exposure: Exposure) -> Tensor:
        """Distorts (B, 3, H, W) linear light in torch, differentiable and without rounding.

        Args:
            light: (B, 3, H, W) float, linear, 1.0 is full scale; B versions of one picture.
            truth: depth and ids of the picture; its colour is not used.
            exposure: camera and scene of the picture.
        """
        found = lens_map(self.lens, exposure.camera.intrinsics)
        return read_bilinear(light, found.x.astype(np.float64), found.y.astype(np.float64))

    def trace(self, samples: PixelSamples, exposure: Exposure) -> PixelSamples:
        """Replaces (N, 1) whole pixels of the distorted picture by the (N, 4) pixels of the pinhole picture that are
        interpolated for them.

        Args:
            samples: pixels of the distorted picture.
            exposure: camera and scene of the picture.
        """
        found = lens_map(self.lens, exposure.camera.intrinsics)
        at = (samples.y[:, 0].astype(int), samples.x[:, 0].astype(int))
        from_x, from_y = found.x[at].astype(np.float64), found.y[at].astype(np.float64)
        low_x, low_y = np.floor(from_x), np.floor(from_y)
        part_x, part_y = from_x - low_x, from_y - low_y
        corners = [(dx, dy) for dy in (0, 1) for dx in (0, 1)]
        shares = [(part_x if dx else 1 - part_x) * (part_y if dy else 1 - part_y) for dx, dy in corners]
        return replace(
            samples,
            x=np.stack([low_x + dx for dx, _ in corners], axis=1),
            y=np.stack([low_y + dy for _, dy in corners], axis=1),
            weight=np.stack(shares, axis=1),
        )

    def check(self, camera: CameraRecord) -> None:
        """Checks that the distortion does not fold the picture over: no two points of the pinhole picture appear
        at the
        same point.

        Args:
            camera: the camera, for its pinhole intrinsics.

        Raises:
            FieldError: the picture would fold over.
        """
        try:
            lens_map(self.lens, camera.intrinsics)
        except ValueError as error:
            raise FieldError("lens", f"{error}; take k1 and k2 nearer to 0, or a narrower field of view") from error

    def recorded(self, camera: CameraRecord) -> CameraRecord:
        """The camera's record, completed with the coefficients of the distortion.

        Args:
            camera: record of the pinhole camera.
        """
        found = lens_map(self.lens, camera.intrinsics)
        return replace(camera, lens=LensRecord(k1=self.lens.k1, k2=self.lens.k2, focal_px=found.focal_px))

    @classmethod
    def from_record(cls, camera: CameraRecord) -> LensDistortion | None:
        """The lens distortion that a camera's record describes; None for a pinhole camera.

        Args:
            camera: the camera's record.
        """
        return None if camera.lens is None else cls(lens=Lens(k1=camera.lens.k1, k2=camera.lens.k2))

    def pixel_map(self, camera: CameraRecord) -> PixelMap:
        """The map between the pixels of the distorted picture and those of the pinhole picture.

        Outside the picture's corners, `forward` is extended linearly, because the polynomial would fold over there or
        grow without bounds.

        Args:
            camera: the camera, for its pinhole intrinsics.

        Raises:
            ValueError: the distortion folds the picture over.
        """
        pinhole, lens = camera.intrinsics, self.lens
        found = lens_map(lens, pinhole)
        middle, focal = np.array([pinhole.cx_px, pinhole.cy_px]), np.array([pinhole.fx_px, pinhole.fy_px])
        corners = np.stack([[found.x[r, c], found.y[r, c]] for r in (0, -1) for c in (0, -1)])
        reach = float(np.linalg.norm((corners - middle) / focal, axis=1).max())
        bent_focal = np.array([found.focal_px, found.focal_px * (pinhole.fy_px / pinhole.fx_px)])

        def forward(pinhole_px: Array) -> Array:
            offset = (np.asarray(pinhole_px) - middle) / focal
            radius = np.linalg.norm(offset, axis=-1, keepdims=True)
            inner = np.minimum(radius, reach)
            square = inner**2
            slope = 1 + 3 * lens.k1 * square + 5 * lens.k2 * square**2
            bent = inner * (1 + lens.k1 * square + lens.k2 * square**2) + slope * (radius - inner)
            return np.asarray(offset * (bent / np.maximum(radius, 1e-12)) * bent_focal + middle)

        return PixelMap(x=found.x, y=found.y, forward=forward)


def distort(view: RawView, lens: Lens, pinhole: Intrinsics) -> RawView:
    """Distorts the view of a pinhole camera: colour is resampled and rounded; depth and ids are taken from the nearest
    pixel.

    Args:
        view: view of the pinhole camera.
        lens: coefficients of the distortion.
        pinhole: intrinsics of the pinhole camera.

    Raises:
        ValueError: the distortion folds the picture over.
    """
    import cv2  # imported here, so that configs can be read without OpenCV

    found = lens_map(lens, pinhole)
    assert view.linear_rgb is not None
    row, column = np.rint(found.y).astype(np.intp), np.rint(found.x).astype(np.intp)
    return RawView(
        linear_rgb=np.asarray(cv2.remap(view.linear_rgb, found.x, found.y, cv2.INTER_LINEAR), dtype=np.uint16),
        depth_m=view.depth_m[row, column],
        geom_id=view.geom_id[row, column],
    )


@lru_cache(maxsize=8)
def lens_map(lens: Lens, pinhole: Intrinsics) -> LensMap:
    """The position in the pinhole picture of each pixel of the distorted picture.

    The distorted picture gets a longer focal length if it would otherwise show directions that the pinhole picture does
    not contain.

    Args:
        lens: coefficients of the distortion.
        pinhole: intrinsics of the pinhole camera.

    Raises:
        ValueError: the distortion folds the picture over.
    """
    low, high = 0.2, 1.0
    if _fits(lens, pinhole, high):
        low = high
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if _fits(lens, pinhole, middle) else (low, middle)
    centre, focal = np.array([pinhole.cx_px, pinhole.cy_px]), np.array([pinhole.fx_px, pinhole.fy_px])
    x, y = np.meshgrid(np.arange(pinhole.width_px) - centre[0], np.arange(pinhole.height_px) - centre[1])
    seen = undistorted(lens, np.stack([x, y], axis=-1) * (low / focal)) * focal + centre
    seen = np.clip(seen, 0, np.array([pinhole.width_px - 1, pinhole.height_px - 1]))
    maps = [np.ascontiguousarray(seen[..., axis], dtype=np.float32) for axis in (0, 1)]
    for one in maps:
        one.setflags(write=False)
    return LensMap(maps[0], maps[1], round(pinhole.fx_px / low, 6))


def undistorted(lens: Lens, distorted: Array) -> Array:
    """Converts points of a distorted picture to the pinhole picture, by Newton's method on the radius.

    Args:
        lens: coefficients of the distortion.
        distorted: (..., 2) points from the principal point, in units of the focal length.

    Returns:
        (..., 2) points of the pinhole picture, in the same unit.

    Raises:
        ValueError: the distortion folds the picture over at a point.
    """
    wanted = np.linalg.norm(distorted, axis=-1)
    radius = wanted.copy()
    for _ in range(_NEWTON_STEPS):
        square = radius**2
        slope = 1 + 3 * lens.k1 * square + 5 * lens.k2 * square**2
        if bool((slope < _LEAST_SLOPE).any()):
            raise ValueError(f"a lens of k1 {lens.k1:g} and k2 {lens.k2:g} folds so wide a picture over")
        radius -= (radius * (1 + lens.k1 * square + lens.k2 * square**2) - wanted) / slope
    return np.asarray(distorted * (radius / np.maximum(wanted, 1e-12))[..., None])


def _fits(lens: Lens, pinhole: Intrinsics, zoom: float) -> bool:
    """Whether the border of the distorted picture lies inside the pinhole picture."""
    half = np.array([(pinhole.width_px - 1) / 2, (pinhole.height_px - 1) / 2])
    centre, focal = np.array([pinhole.cx_px, pinhole.cy_px]), np.array([pinhole.fx_px, pinhole.fy_px])
    ticks = np.linspace(-1, 1, 65)
    border = np.concatenate([np.column_stack([ticks, np.full_like(ticks, edge)]) for edge in (-1, 1)])
    border = np.concatenate([border, border[:, ::-1]]) * half
    off_middle = centre - half
    try:
        seen = undistorted(lens, (border - off_middle) * (zoom / focal)) * focal + off_middle
    except ValueError:
        return False
    return bool((np.abs(seen) <= half + 1e-6).all())
