"""Where the pixels of a picture read a surface's texture.

Every pixel has a few samples. A sample is a place on the face, a mip level and a weight; a pixel shows the weighted
mean. Samples that miss the face have no weight: probes hold how much of a pixel the face covers, and what is sampled
is the face's share alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from gear.camera.optics import BLUR_STEPS, lens_map
from gear.contracts.rendering import Quality
from gear.values.geometry import Array, RigidTransform
from gear.values.ground_truth import SurfaceTruth
from gear.values.optics import CameraEffects
from gear.values.scene import CameraRecord, SurfaceRecord, Vec3
from gear.world.surfaces.face_texture import FACE_SIZE_PX

Mask = npt.NDArray[np.bool_]
_QUARTERS = ((-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Samples:
    """Samples of N pixels, S each.

    Attributes:
        u, v: (N, S) places on the face, 0..1 to the right and down.
        level: (N, S) mip level, a real number; 0 is the face itself.
        weight: (N, S) float64; rows sum to 1.
        coverage: (N,) share of the weight that hit the face before rows were scaled to 1.
    """

    u: Array
    v: Array
    level: Array
    weight: Array
    coverage: Array


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Scan:
    """How a renderer and a camera take samples.

    Attributes:
        supersampled: 2 x 2 samples a pixel (`film` of all but `classic`).
        extrapolates: what only touches a pixel is still sampled at the pixel's middle (OpenGL's multi-sampling).
        smooths: edges were smoothed by the filter of `fast`.
        effects: of the camera.
    """

    supersampled: bool
    extrapolates: bool
    smooths: bool
    effects: CameraEffects

    @staticmethod
    def of(renderer_name: str, quality: Quality, effects: CameraEffects) -> Scan:
        """For a renderer in a quality."""
        is_film = quality == "film"
        return Scan(
            supersampled=is_film and renderer_name != "classic",
            extrapolates=is_film and renderer_name == "classic",
            smooths=not is_film,
            effects=effects,
        )


def unit_from_image(truth: SurfaceTruth, surface: SurfaceRecord, camera: CameraRecord) -> Array:
    """(3, 3) homography from index pixels of the pinhole to patch coordinates 0..1; the third row is positive in front.

    It exists for surfaces, too, that reach behind the camera.
    """
    camera_from_surface = RigidTransform("camera", "surface", np.array(truth.camera_from_surface).reshape(4, 4))
    right_m = camera_from_surface.rotation[:, 0] * surface.width_m
    down_m = camera_from_surface.rotation[:, 1] * surface.height_m
    top_left_m = camera_from_surface.translation_m - (right_m + down_m) / 2
    homography = camera.intrinsics.matrix @ np.stack([right_m, down_m, top_left_m], axis=1)
    return np.asarray(np.linalg.inv(homography))


def take_samples(
    scan: Scan, unit: Array, pixels: tuple[Array, Array], mask: Mask, camera: CameraRecord, velocity_mps: Vec3
) -> Samples:
    """The samples of some pixels.

    Args:
        scan: how samples are taken.
        unit: of `unit_from_image`.
        pixels: (N,) columns and (N,) rows, index pixels.
        mask: (H, W) where the face is seen, by ids at pixel centres.
        camera: who looks.
        velocity_mps: of the camera, in the world.
    """
    x, y = (np.asarray(axis, dtype=np.float64)[:, None] for axis in pixels)
    weight = np.ones_like(x)
    if scan.effects.lens.bends:
        x, y, weight = _through_lens(x, y, scan, camera)
    elif scan.smooths:
        x, y, weight = _smoothed(x, y, mask)
    if scan.effects.shutter_s > 0:
        x, y, weight = _blurred(x, y, weight, unit, scan, camera, velocity_mps)
    step_px = 1.0
    if scan.supersampled:
        step_px = 0.5
        x, y = (np.concatenate([axis + corner[i] for corner in _QUARTERS], axis=1) for i, axis in enumerate((x, y)))
        weight = np.tile(weight / len(_QUARTERS), (1, len(_QUARTERS)))
    u, v, in_front = _on_face(unit, x, y)
    hits = in_front & (u >= 0) & (u <= 1) & (v >= 0) & (v <= 1)
    counted = weight if scan.extrapolates else weight * hits
    coverage = np.asarray((weight * hits).sum(axis=1))
    total = counted.sum(axis=1, keepdims=True)
    # A pixel that the face only grazes, between all samples, shows the border nearest to it.
    counted = np.where(total > 1e-9, counted / np.maximum(total, 1e-9), weight / weight.sum(axis=1, keepdims=True))
    if not scan.extrapolates:
        u, v = np.clip(u, 0, 1), np.clip(v, 0, 1)
    level = _level(unit, x, y, step_px)
    return Samples(u=u, v=v, level=level, weight=counted, coverage=coverage)


def _on_face(unit: Array, x: Array, y: Array) -> tuple[Array, Array, Mask]:
    """Places on the face, and whether they lie before the camera."""
    u, v, depth = (row[0] * x + row[1] * y + row[2] for row in unit)
    in_front = depth > 1e-12
    safe = np.where(in_front, depth, 1.0)
    return np.where(in_front, u / safe, -1.0), np.where(in_front, v / safe, -1.0), in_front


def _level(unit: Array, x: Array, y: Array, step_px: float) -> Array:
    """log2 of the longer of a sample's two edges in texels: the level is isotropic."""
    width, height = FACE_SIZE_PX
    u, v, _ = _on_face(unit, x, y)
    edges = []
    for dx, dy in ((step_px, 0.0), (0.0, step_px)):
        to_u, to_v, _ = _on_face(unit, x + dx, y + dy)
        edges.append(np.hypot((to_u - u) * width, (to_v - v) * height))
    return np.asarray(np.log2(np.maximum(np.maximum(*edges), 1e-6)))


def _smoothed(x: Array, y: Array, mask: Mask) -> tuple[Array, Array, Array]:
    """The 3 x 3 tent of `fast` where the face's visible mask ends, on those neighbours that show the face."""
    padded = np.pad(mask, 1)
    inner = np.pad(mask, 1, mode="edge")  # the picture's border is no edge
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
    weight[lost, 4] = 1.0  # the middle
    return np.stack(xs, axis=1), np.stack(ys, axis=1), weight


def _through_lens(x: Array, y: Array, scan: Scan, camera: CameraRecord) -> tuple[Array, Array, Array]:
    """The four pinhole pixels that a pixel behind the lens mixes."""
    found = lens_map(scan.effects.lens, camera.width_px, camera.height_px, camera.focal_px)
    at = (y[:, 0].astype(int), x[:, 0].astype(int))
    from_x, from_y = found.x[at].astype(np.float64), found.y[at].astype(np.float64)
    low_x, low_y = np.floor(from_x), np.floor(from_y)
    part_x, part_y = from_x - low_x, from_y - low_y
    corners = [(dx, dy) for dy in (0, 1) for dx in (0, 1)]
    xs = np.stack([low_x + dx for dx, _ in corners], axis=1)
    ys = np.stack([low_y + dy for _, dy in corners], axis=1)
    shares = [(part_x if dx else 1 - part_x) * (part_y if dy else 1 - part_y) for dx, dy in corners]
    return xs, ys, np.stack(shares, axis=1)


def _blurred(
    x: Array, y: Array, weight: Array, unit: Array, scan: Scan, camera: CameraRecord, velocity_mps: Vec3
) -> tuple[Array, Array, Array]:
    """Where a pixel's light comes from while the shutter is open; as `gear.camera.optics.motion_blurred`."""
    velocity = camera.world_from_camera_transform.rotation.T @ np.asarray(velocity_mps)
    centre_x, centre_y = (camera.width_px - 1) / 2, (camera.height_px - 1) / 2
    # The third row of the homography is the inverse of depth.
    inverse = np.maximum(unit[2, 0] * x + unit[2, 1] * y + unit[2, 2], 0.0)
    xs, ys = [], []
    for moment in np.linspace(-0.5, 0.5, BLUR_STEPS):
        shift = velocity * moment * scan.effects.shutter_s
        scale = 1 / np.maximum(1 - shift[2] * inverse, 0.1)
        xs.append((x - centre_x - camera.focal_px * shift[0] * inverse) * scale + centre_x)
        ys.append((y - centre_y - camera.focal_px * shift[1] * inverse) * scale + centre_y)
    return np.concatenate(xs, axis=1), np.concatenate(ys, axis=1), np.tile(weight / BLUR_STEPS, (1, BLUR_STEPS))
