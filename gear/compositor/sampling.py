"""The texture samples of the pixels that show a patch.

Each pixel has a few samples: a position on the patch's surface, a mip level and a weight. Its colour is their weighted
mean. Samples beside the surface have weight 0, because the share of a pixel that the surface covers is already in the
probes (renders with the surface black and white).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from gear.camera.effects import Effect, Exposure, PixelSamples
from gear.contracts.rendering import Quality
from gear.values.geometry import Array, RigidTransform
from gear.values.ground_truth import SurfaceTruth
from gear.values.scene import CameraRecord, SurfaceRecord
from gear.world.surfaces.face_texture import FACE_SIZE_PX

Mask = npt.NDArray[np.bool_]
_QUARTERS = ((-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Samples:
    """Texture samples of N pixels, S samples for each pixel.

    Attributes:
        u, v: (N, S) positions on the surface, 0..1 to the right and down.
        level: (N, S) mip level, not rounded; 0 is the finest.
        weight: (N, S) float64 weights; rows sum to 1.
        coverage: (N,) share of the weight that lay on the surface before rows were scaled to sum 1.
    """

    u: Array
    v: Array
    level: Array
    weight: Array
    coverage: Array


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SampleScheme:
    """The rules by which a renderer and a camera take texture samples.

    Attributes:
        supersampled: whether each pixel has 2 x 2 samples (quality `film` of all renderers but `classic`).
        extrapolates: whether a surface that only touches a pixel is still sampled at the pixel's centre, as OpenGL's
            multi-sampling does.
        smooths: whether edges are smoothed by the filter of quality `fast`.
        effects: active effects of the camera, in the order in which they are applied.
    """

    supersampled: bool
    extrapolates: bool
    smooths: bool
    effects: tuple[Effect, ...] = ()

    @staticmethod
    def of(renderer_name: str, quality: Quality, effects: tuple[Effect, ...]) -> SampleScheme:
        """Makes the sampling rules of a renderer and a quality setting.

        Args:
            renderer_name: name of the renderer that made the pictures.
            quality: quality with which it made them: `film` or `fast`.
            effects: the camera's active effects, in the order in which they are applied.
        """
        is_film = quality == "film"
        return SampleScheme(
            supersampled=is_film and renderer_name != "classic",
            extrapolates=is_film and renderer_name == "classic",
            smooths=not is_film,
            effects=effects,
        )


def unit_from_image(truth: SurfaceTruth, surface: SurfaceRecord, camera: CameraRecord) -> Array:
    """Returns the (3, 3) homography from index pixels of the pinhole picture to positions on a patch surface, 0..1
    to the right and down.

    Its third row gives the inverse of depth, positive in front of the camera. It also exists for surfaces that reach
    behind the camera.

    Args:
        truth: ground truth of the surface in this view, for its pose relative to the camera.
        surface: the surface, for its width and height in metres.
        camera: the camera, for its pinhole intrinsics.
    """
    camera_from_surface = RigidTransform("camera", "surface", np.array(truth.camera_from_surface).reshape(4, 4))
    right_m = camera_from_surface.rotation[:, 0] * surface.width_m
    down_m = camera_from_surface.rotation[:, 1] * surface.height_m
    top_left_m = camera_from_surface.translation_m - (right_m + down_m) / 2
    homography = camera.intrinsics.matrix @ np.stack([right_m, down_m, top_left_m], axis=1)
    return np.asarray(np.linalg.inv(homography))


def take_samples(
    scheme: SampleScheme, unit: Array, pixels: tuple[Array, Array], mask: Mask, exposure: Exposure
) -> Samples:
    """Computes the texture samples of some pixels.

    Args:
        scheme: rules by which samples are taken.
        unit: (3, 3) homography, from `unit_from_image`.
        pixels: (N,) columns and (N,) rows, index pixels.
        mask: (H, W) bool, True for pixels whose id is that of the surface.
        exposure: camera and scene.

    Returns:
        The samples of the N pixels, in the order of `pixels`.
    """
    x, y = (np.asarray(axis, dtype=np.float64)[:, None] for axis in pixels)
    weight = np.ones_like(x)
    if scheme.smooths and not any(effect.MOVES_PIXELS for effect in scheme.effects):
        x, y, weight = _smoothed(x, y, mask)

    def inverse_depth(x: Array, y: Array) -> Array:
        """Inverse of planar depth, from the third row of the homography."""
        return np.asarray(unit[2, 0] * x + unit[2, 1] * y + unit[2, 2])

    traced = PixelSamples(x=x, y=y, weight=weight, inverse_depth=inverse_depth)
    for effect in reversed(scheme.effects):
        traced = effect.trace(traced, exposure)
    x, y, weight = traced.x, traced.y, traced.weight
    step_px = 1.0
    if scheme.supersampled:
        step_px = 0.5
        x, y = (np.concatenate([axis + corner[i] for corner in _QUARTERS], axis=1) for i, axis in enumerate((x, y)))
        weight = np.tile(weight / len(_QUARTERS), (1, len(_QUARTERS)))
    u, v, in_front = _on_face(unit, x, y)
    hits = in_front & (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1)
    counted = weight if scheme.extrapolates else weight * hits
    coverage = np.asarray((weight * hits).sum(axis=1))
    total = counted.sum(axis=1, keepdims=True)
    # Where the face lies between all samples of a pixel, the nearest position on its border is read.
    counted = np.where(total > 1e-9, counted / np.maximum(total, 1e-9), weight / weight.sum(axis=1, keepdims=True))
    if not scheme.extrapolates:
        u, v = np.clip(u, 0, 1), np.clip(v, 0, 1)
    level = _level(unit, x, y, step_px)
    return Samples(u=u, v=v, level=level, weight=counted, coverage=coverage)


def _on_face(unit: Array, x: Array, y: Array) -> tuple[Array, Array, Mask]:
    """Positions u and v of pixels on the surface, 0..1 inside, and whether they are in front of the camera."""
    u, v, depth = (row[0] * x + row[1] * y + row[2] for row in unit)
    in_front = depth > 1e-12
    safe = np.where(in_front, depth, 1.0)
    return np.where(in_front, u / safe, -1.0), np.where(in_front, v / safe, -1.0), in_front


def _level(unit: Array, x: Array, y: Array, step_px: float) -> Array:
    """Mip levels: the base-2 logarithm of the longer edge of a sample's footprint in texels, as in isotropic
    filtering.
    """
    width, height = FACE_SIZE_PX
    u, v, _ = _on_face(unit, x, y)
    edges = []
    for dx, dy in ((step_px, 0.0), (0.0, step_px)):
        to_u, to_v, _ = _on_face(unit, x + dx, y + dy)
        edges.append(np.hypot((to_u - u) * width, (to_v - v) * height))
    return np.asarray(np.log2(np.maximum(np.maximum(*edges), 1e-6)))


def _smoothed(x: Array, y: Array, mask: Mask) -> tuple[Array, Array, Array]:
    """The 3 x 3 edge filter of quality `fast`: pixels at the border of the visible mask are averaged with those
    neighbours that show the surface.
    """
    padded = np.pad(mask, 1)
    inner = np.pad(mask, 1, mode="edge")  # the border of the picture does not count as an edge
    column, row = x[:, 0].astype(int), y[:, 0].astype(int)

    def shows(grid: Mask, dx: int, dy: int) -> Mask:
        found: Mask = grid[row + 1 + dy, column + 1 + dx]
        return found

    plain = shows(inner, 0, 0)
    for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        plain = plain & shows(inner, dx, dy)
    kernel = cv2.getGaussianKernel(3, 0.8)[:, 0]
    xs, ys, weights = [], [], []
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            smooth = kernel[dx + 1] * kernel[dy + 1] * shows(padded, dx, dy)
            xs.append(x[:, 0] + dx)
            ys.append(y[:, 0] + dy)
            weights.append(np.where(plain, float(dx == 0 and dy == 0), smooth))
    weight = np.stack(weights, axis=1)
    lost = weight.sum(axis=1) <= 0
    weight[lost, 4] = 1.0  # the pixel itself
    return np.stack(xs, axis=1), np.stack(ys, axis=1), weight
