"""Contact shadows: a car or person hides part of the sky from the ground under and beside it.

    L' = L (1 - s o)

o is the share of the sky that the actor hides from a point on level ground, weighted by the cosine of the angle to the
vertical. It is computed once per asset: the mean of the shadows of its triangles over directions from the whole sky. s
is the sky's share in the light of the ground. Under a vehicle s is 1, because the sun does not reach that ground.
Beside a vehicle, the frame does not show whether the ground is in the sun, so s is the mean of its values in sun and
shade. o and s do not depend on any albedo, so frames stay linear.

The renderers of gear do not compute these shadows: their sky light casts no shadows, and `gear.render.occlusion` has a
range of a few decimetres. Without them, cars seem to float under an overcast sky and in the shade of houses.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import cv2
import numpy as np
import numpy.typing as npt

from gear.camera.fractal import smooth_step
from gear.camera.response import DISPLAY_POWER
from gear.camera.surface_points import longest_edges, points_on
from gear.values.frames import FloatImage, Shape, UInt16Image
from gear.values.geometry import Array, RigidTransform
from gear.values.scene import ActorRecord, CameraRecord, SceneRecord

Mask = npt.NDArray[np.bool_]

DIRECTIONS = 128
MOST_HIDDEN = 0.94
"""Largest share of the sky's light that is taken away; the ground around reflects the rest."""

OUTLINE = np.float32(0.5)
"""Share of a pixel on an actor's silhouette that shows the background."""

_FULL_FROM, _BESIDE_TO = 0.75, 0.4
"""Two hidden shares of the sky. Above the first share, the ground is assumed to get no sunlight; below the second,
sunlight is possible.
"""

_CELLS_PER_M = {"large": 12.5, "small": 16.0}
_LARGE_M = 2.5
_REACH_HEIGHTS, _LEAST_REACH_M, _MOST_REACH_M = 1.6, 0.6, 3.0
_RIM = 0.4
_STEP_M, _FADE_M = 0.2, 0.15
"""Height differences between ground and wheels, metres. Up to the first one (a kerb) shadows have full strength; over
the second, they fade to 0.
"""

_NEAREST_M, _FARTHEST_M = 0.3, 200.0
_MOST_POINTS = 400_000
_BAND_ROWS = 32
_CUBE = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
_EDGES = np.array([(i, i | bit) for bit in (1, 2, 4) for i in range(8) if not i & bit])


@dataclass(frozen=True, slots=True, eq=False)
class SkyOcclusion:
    """Share of the sky that one asset hides from the level ground, as a map of the ground under and around the asset.

    Attributes:
        share: (rows, columns) float32 in 0..1, 0 at the border. Row indices increase to the actor's left, column
            indices to its front.
        cells_per_m: cells per metre along both axes.
    """

    share: FloatImage
    cells_per_m: float

    @staticmethod
    def of(shape: Shape) -> SkyOcclusion:
        """Computes the shares as the mean of shadows from `DIRECTIONS` directions, more of them steep than flat
        (cosine distribution).

        The asset is treated as solid from its underside up.

        Args:
            shape: triangles of the asset in the actor frame; it stands on z = 0.
        """
        rows, columns, cells_per_m = grid_of(shape)
        layers = _layers(_points(shape, 1.5 * cells_per_m) * cells_per_m, rows, columns)
        hidden = _shadow_count(layers) / np.float32(DIRECTIONS)
        hidden = cv2.blur(hidden, (3, 3), borderType=cv2.BORDER_CONSTANT)
        for axis, size in ((0, rows), (1, columns)):
            from_border = (np.minimum(np.arange(size), np.arange(size)[::-1]) / cells_per_m).astype(np.float32)
            rim = smooth_step(from_border, 0, _RIM * _reach_m(shape))
            hidden *= rim[:, None] if axis == 0 else rim
        return SkyOcclusion(hidden, cells_per_m)


def _reach_m(shape: Shape) -> float:
    """Distance from an asset's outline up to which the ground is darkened, metres."""
    top_m = float(shape.box_centre_m[2] + shape.box_size_m[2] / 2)
    return min(max(_REACH_HEIGHTS * top_m, _LEAST_REACH_M), _MOST_REACH_M)


def grid_of(shape: Shape) -> tuple[int, int, float]:
    """Rows, columns and cells per metre of an asset's `SkyOcclusion`.

    Args:
        shape: triangles of the asset in the actor frame.
    """
    cells_per_m = _CELLS_PER_M["large" if max(shape.box_size_m[:2]) > _LARGE_M else "small"]
    half_m = np.abs(shape.box_centre_m[:2]) + shape.box_size_m[:2] / 2 + _reach_m(shape)
    columns, rows = (2 * math.ceil(side * cells_per_m) + 1 for side in half_m)
    return rows, columns, cells_per_m


def _radius_m(shape: Shape) -> float:
    """Distance from an actor's origin within which its contact shadows lie, metres."""
    rows, columns, cells_per_m = grid_of(shape)
    return math.hypot(columns, rows) / (2 * cells_per_m) + _STEP_M + _FADE_M


def _layers(points: Array, rows: int, columns: int) -> list[Mask]:
    """(rows, columns) bool per layer of cubic cells, from the ground up: the cells that the asset fills."""
    cells = np.rint(points[:, 1]).astype(np.int64) + rows // 2, np.rint(points[:, 0]).astype(np.int64) + columns // 2
    low, high = np.full((rows, columns), np.inf), np.full((rows, columns), -np.inf)
    np.minimum.at(low, cells, points[:, 2])
    np.maximum.at(high, cells, points[:, 2])
    heights = np.arange(max(math.ceil(points[:, 2].max()), 1)) + 0.5
    return [(low <= height + 0.5) & (high >= height - 0.5) for height in heights]


def _shadow_count(layers: list[Mask]) -> FloatImage:
    """(rows, columns) float32 number of directions, of `DIRECTIONS`, from which each cell is shadowed.

    A picture of bits is one integer, so that one shift moves all of its cells; arrays take 2.4 times as long.
    """
    rows, columns = layers[0].shape
    # A row has as many empty columns beside it as a shift can move cells beyond its ends.
    stride = 2 * columns
    padded = np.zeros((rows, stride), np.bool_)
    bits = []
    for layer in layers:
        padded[:, :columns] = layer
        bits.append(int.from_bytes(np.packbits(padded, bitorder="little").tobytes(), "little"))
    size = -(-rows * stride // 8)
    inside = (1 << rows * stride) - 1
    assert DIRECTIONS < 256
    count = np.zeros(8 * size, np.uint8)
    # Each layer is shifted in proportion to its height.
    moves = np.rint((np.arange(len(layers)) + 0.5)[:, None, None] * np.array(list(_slopes()))).astype(np.int64)
    is_inside = (np.abs(moves) < (columns, rows)).all(axis=2)
    shifts = moves @ (1, stride)
    for direction in range(DIRECTIONS):
        shadow = 0
        for picture, shift in zip(bits, shifts[is_inside[:, direction], direction].tolist(), strict=False):
            shadow |= picture >> shift if shift >= 0 else picture << -shift
        data = (shadow & inside).to_bytes(size, "little")
        count += np.unpackbits(np.frombuffer(data, np.uint8), bitorder="little")
    return count[: rows * stride].reshape(rows, stride)[:, :columns].astype(np.float32)


def _slopes() -> Iterator[tuple[float, float]]:
    """Shifts of shadows east and north per metre of height, for directions on a spiral with a cosine distribution."""
    for number in range(DIRECTIONS):
        square = (number + 0.5) / DIRECTIONS
        length, turn = math.sqrt(square / (1 - square)), number * math.pi * (3 - math.sqrt(5))
        yield length * math.cos(turn), length * math.sin(turn)


def _points(shape: Shape, per_m: float) -> Array:
    """(N, 3) points on all triangles, about `per_m` per metre along and across, without random draws."""
    corners = shape.vertices_m[shape.faces]
    steps = np.maximum(np.ceil(longest_edges(corners) * per_m).astype(np.int64), 1)
    found = [shape.vertices_m[np.unique(shape.faces)], *points_on(corners, steps)]
    points = np.concatenate(found)
    return points[:: 1 + len(points) // _MOST_POINTS]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ContactShadows:
    """The contact shadows of a world's actors in one weather.

    Attributes:
        shapes: triangles of every asset that may take part in a scene, by name.
        even_share: share of the light on open level ground that does not come from the sun directly, 0..1.
        is_display: whether frames hold display values instead of light (the classic renderer).
        occlusion_of: computes the map of one asset, or reads it from a cache.
    """

    shapes: Mapping[str, Shape]
    even_share: float
    is_display: bool
    occlusion_of: Callable[[Shape], SkyOcclusion] = SkyOcclusion.of
    _known: dict[str, SkyOcclusion] = field(default_factory=dict, init=False, repr=False)

    def apply(
        self, linear_rgb: UInt16Image, depth_m: FloatImage, is_ground: Mask, camera: CameraRecord, record: SceneRecord
    ) -> UInt16Image:
        """Darkens the ground under and beside the actors.

        Args:
            linear_rgb: (H, W, 3) uint16, gear's linear frame.
            depth_m: (H, W) float32 planar z, NaN where nothing was hit.
            is_ground: (H, W) bool, True where a pixel shows ground.
            camera: the camera that takes the picture.
            record: the scene, for its actors.

        Returns:
            (H, W, 3) uint16 frame with contact shadows; `linear_rgb` itself if no pixel is darkened.
        """
        left = self.factors(depth_m, is_ground, camera, record)
        if left is None:
            return linear_rgb
        shaded = linear_rgb.copy()
        for top in range(0, len(left), _BAND_ROWS):
            band = slice(top, top + _BAND_ROWS)
            if cv2.minMaxLoc(left[band])[0] < 1:
                cv2.multiply(linear_rgb[band], cv2.merge([left[band]] * 3), dst=shaded[band], dtype=cv2.CV_16U)
        return shaded

    def factors(
        self, depth_m: FloatImage, is_ground: Mask, camera: CameraRecord, record: SceneRecord
    ) -> FloatImage | None:
        """Returns the (H, W) float32 factors 0..1 by which contact shadows darken a frame; None if no pixel is
        darkened.

        Args:
            depth_m: (H, W) float32 planar z, NaN where nothing was hit.
            is_ground: (H, W) bool, True where a pixel shows ground.
            camera: the camera that takes the picture.
            record: the scene, for its actors.
        """
        left: FloatImage | None = None
        world_from_camera = camera.world_from_camera_transform
        for actor in self._before_and_near(record, camera):
            shape = self.shapes[actor.asset]
            actor_from_camera = actor.world_from_actor.transform("world", "actor").inverse() @ world_from_camera
            box = _box_in_picture(actor_from_camera, shape, camera)
            if box is None or not is_ground[box].any():
                continue
            sky = self._sky(actor.asset, shape)
            if left is None:
                left = np.ones(depth_m.shape, np.float32)
            for top in range(box[0].start, box[0].stop, _BAND_ROWS):
                band = (slice(top, min(top + _BAND_ROWS, box[0].stop)), box[1])
                if is_ground[band].any():
                    left[band] *= self._beside(actor_from_camera, sky, depth_m, is_ground, band, camera)
        if left is None:
            return None
        _soften_outlines(left, is_ground)
        return left ** np.float32(DISPLAY_POWER) if self.is_display else left

    def _before_and_near(self, record: SceneRecord, camera: CameraRecord) -> list[ActorRecord]:
        """The actors that may darken ground in view: those with a shape that stand before the camera and near it.

        This test takes a tenth of the time of the exact one, for which each actor's pose is inverted.
        """
        actors = [actor for actor in record.actors if actor.asset in self.shapes]
        if not actors:
            return []
        reach_m = np.array([_radius_m(self.shapes[actor.asset]) for actor in actors])
        from_camera = np.array([actor.world_from_actor.position_m for actor in actors], np.float64)
        from_camera -= camera.world_from_camera_transform.translation_m
        ahead = from_camera @ camera.world_from_camera_transform.rotation[:, 2]
        is_near = (ahead + reach_m >= _NEAREST_M) & (ahead - reach_m <= _FARTHEST_M)
        return [actor for actor, near in zip(actors, is_near.tolist(), strict=True) if near]

    def _sky(self, asset: str, shape: Shape) -> SkyOcclusion:
        if asset not in self._known:
            self._known[asset] = self.occlusion_of(shape)
        return self._known[asset]

    def _beside(
        self,
        actor_from_camera: RigidTransform,
        sky: SkyOcclusion,
        depth_m: FloatImage,
        is_ground: Mask,
        box: tuple[slice, slice],
        camera: CameraRecord,
    ) -> FloatImage:
        """(h, w) factors of one actor in a box of the picture, 1 where no ground is seen.

        Masks are factors here, because masked assignments take as long as ten multiplications.
        """
        turn = actor_from_camera.rotation.astype(np.float32)
        place = actor_from_camera.translation_m.astype(np.float32)
        z = depth_m[box]
        pinhole = camera.intrinsics
        x = _slopes_of(box[1], pinhole.cx_px, pinhole.fx_px)
        y = _slopes_of(box[0], pinhole.cy_px, pinhole.fy_px)[:, None]
        scale, (rows, columns) = np.float32(sky.cells_per_m), sky.share.shape
        # Where the map is read, to the actor's front and to its left, in cells; and the height of the ground.
        places = []
        for axis, unit, middle in ((0, scale, columns // 2), (1, scale, rows // 2), (2, np.float32(1), 0)):
            along = x * (unit * turn[axis, 0]) + (y * turn[axis, 1] + turn[axis, 2]) * unit
            along *= z
            along += unit * place[axis] + np.float32(middle)
            places.append(along)
        hidden = cv2.remap(sky.share, places[0], places[1], cv2.INTER_LINEAR, borderValue=0)
        hidden *= is_ground[box]
        up = places[2]
        level = 1 - smooth_step(np.abs(up, out=up), _STEP_M, _FADE_M)
        beside = np.float32(sky_share_beside(self.even_share))
        worth = beside + (1 - beside) * smooth_step(hidden, _BESIDE_TO, _FULL_FROM - _BESIDE_TO)
        hidden *= np.float32(-MOST_HIDDEN)
        hidden *= worth
        hidden *= level
        hidden += 1
        cv2.patchNaNs(hidden, 1.0)
        return np.asarray(hidden, dtype=np.float32)


def _soften_outlines(left: FloatImage, is_ground: Mask) -> None:
    """Darkens pixels on the silhouette of an object in front of the ground, which show some of the ground.

    Args:
        left: (H, W) factors for pixels that show ground, 1 for others; changed in place.
        is_ground: (H, W) bool, True where a pixel shows ground.
    """
    rows = np.flatnonzero(left.min(axis=1) < 1)
    if not len(rows):
        return
    part = np.s_[max(int(rows[0]) - 1, 0) : int(rows[-1]) + 2]
    darkest = cv2.erode(left[part], cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)))
    darkest *= OUTLINE
    darkest += 1 - OUTLINE
    cv2.copyTo(darkest, (~is_ground[part]).view(np.uint8), left[part])


def sky_share_beside(even_share: float) -> float:
    """Returns the sky's share, 0..1, of the light on the ground beside an actor: the mean of 1 (ground in shade)
    and of the share in the sun.

    Args:
        even_share: share of the light on open level ground that does not come from the sun directly, 0..1.
    """
    return (1 + even_share) / 2


def _slopes_of(part: slice, centre_px: float, focal_px: float) -> FloatImage:
    """(n,) tangents of the rays through some columns or rows, index pixels."""
    return ((np.arange(part.start, part.stop) - centre_px) / focal_px).astype(np.float32)


def _box_in_picture(
    actor_from_camera: RigidTransform, shape: Shape, camera: CameraRecord
) -> tuple[slice, slice] | None:
    """Rows and columns that contain all ground near an actor; None where it is out of view."""
    rows, columns, cells_per_m = grid_of(shape)
    half_m = np.array((columns // 2, rows // 2)) / cells_per_m
    corners = _CUBE * (*half_m, _STEP_M + _FADE_M)
    camera_from_actor = actor_from_camera.inverse()
    corners = corners @ camera_from_actor.rotation.T + camera_from_actor.translation_m
    seen = _before_camera(corners)
    if not len(seen) or seen[:, 2].min() > _FARTHEST_M:
        return None
    box = []
    pinhole = camera.intrinsics
    of_axes = (
        (0, pinhole.width_px, pinhole.fx_px, pinhole.cx_px),
        (1, pinhole.height_px, pinhole.fy_px, pinhole.cy_px),
    )
    for axis, size, focal_px, centre_px in reversed(of_axes):
        places = seen[:, axis] / seen[:, 2] * focal_px + (centre_px + 0.5)
        low, high = (min(max(end, 0), size) for end in (math.floor(places.min()), math.ceil(places.max())))
        if low >= high:
            return None
        box.append(slice(low, high))
    return box[0], box[1]


def _before_camera(corners: Array) -> Array:
    """(N, 3) corners of a box in the camera frame, clipped at the near plane."""
    ends = corners[_EDGES]
    first, last = ends[:, 0, 2] - _NEAREST_M, ends[:, 1, 2] - _NEAREST_M
    cut = first * last < 0
    share = (first[cut] / (first[cut] - last[cut]))[:, None]
    return np.concatenate([corners[corners[:, 2] >= _NEAREST_M], ends[cut, 0] + share * (ends[cut, 1] - ends[cut, 0])])
