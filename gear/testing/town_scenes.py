"""Checks of a town's scenes. Each function returns the problems that it finds, one line each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from gear.config.collection import SplitConfig
from gear.render.registry import open_renderer
from gear.testing.town_facts import VISIBLE_GROUPS, Rays, TownUnderTest
from gear.values.errors import GearError
from gear.values.frames import FloatImage, IdImage
from gear.values.labels import GROUND_CODES, LABEL_BY_NAME, LABELS
from gear.values.rig import CameraMount, Rig
from gear.values.rng import derive_rng
from gear.values.scene import SceneRecord
from gear.world.planner import ScenePlanner
from gear.world.world import PlacedStage, World

RIG = Rig(cameras=(CameraMount(name="rgb", width_px=640, height_px=320),))
LARGE_RIG = Rig(cameras=(CameraMount(name="rgb", width_px=2048, height_px=1024),))
"""Camera of `open_backs`, with pixels of 5 cm at a distance of 50 m."""

FACE_GRID = (9, 5)
PIXELS = 400
NOTHING = 255
"""Label code of pixels that show no geom (the sky)."""

GROUND = LABEL_BY_NAME["ground"].code
CLOSED = frozenset({*GROUND_CODES, LABEL_BY_NAME["building"].code, LABEL_BY_NAME["wall"].code})
"""Codes of the labels whose meshes must have no holes: ground, buildings, walls."""

PINHOLES_A_MILLION = 5
"""Number of pinholes allowed per million pixels, because outlines that meet within a pixel look like cracks too."""

SLIVERS_A_MILLION = 5
"""Number of slivers allowed per million pixels, because a thin part of a yard can also be seen from far away."""

BACKS_A_MILLION = 0.5
"""Number of pieces of sky allowed per million pixels where rays hit a geom, because rasterisers leave single pixels
open where walls meet in the middle of an edge."""

SLIVER_PX = 3
"""Largest number of pixels of a sliver."""

SURFACE_RATIO = 1.1
"""Depths of neighbouring pixels on one surface differ by less than this factor."""

DEPTH_TOLERANCE = 1e-3
"""Largest relative error of a depth of the classic renderer, whose depth buffer is a float up to a far plane."""


BOARD_GROUND_M = 0.4
"""Largest vertical distance of a billboard's foot from the ground, because footings may be sunk or raised."""

BOARD_LOOK_M = 1.2
"""Height above a billboard's foot at which the rays to the ground start."""


def misplaced(town: TownUnderTest) -> list[str]:
    """One line for a scene library of another town, and for each board that is out of bounds or off the ground.

    Args:
        town: the town under test.
    """
    problems = []
    if town.scenes.town != town.library.town_name:
        problems.append(f"the scene library is for {town.scenes.town!r}, the town is {town.library.town_name!r}")
    xmin, ymin, xmax, ymax = town.graph.bounds_m
    for name, scene in town.scenes.scenes.items():
        for number, board in enumerate(scene.boards):
            x_m, y_m, z_m = board.position_m
            where = f"scene {name}: board {number} at ({x_m:g}, {y_m:g})"
            if not (xmin <= x_m <= xmax and ymin <= y_m <= ymax):
                problems.append(f"{where} stands outside of town.bounds")
                continue
            ground_m = town.ground.height_m(np.array(board.position_m), BOARD_LOOK_M)
            if np.isnan(ground_m):
                problems.append(f"{where} has no ground below it")
            elif abs(z_m - ground_m) > BOARD_GROUND_M:
                problems.append(f"{where} has its foot at {z_m:.2f} m, the ground is at {ground_m:.2f} m")
    return problems


def unusable(town: TownUnderTest, names: Sequence[str], samples: int, min_visible: float) -> list[str]:
    """One line for each scene that cannot be composed or planned, and for each board hidden in a planned sample.

    A board is hidden if less than the share `min_visible` is visible.

    Args:
        town: the town.
        names: names of the scenes.
        samples: number of planned samples of each scene.
        min_visible: smallest visible share of a board, 0..1.
    """
    problems = []
    for name in names:
        try:
            world = town.world(name)
            planner = _planner(world, samples)
            for index in range(samples):
                record = planner.plan(index)
                problems += _hidden_faces(world, record, min_visible)
        except GearError as error:
            problems.append(f"scene {name}: {error}")
    return problems


def cracks(town: TownUnderTest, samples: int) -> list[str]:
    """One line for each crack between meshes in rendered samples of the first scene.

    Cracks are pixels of sky below the horizon that ground surrounds, the single pixels of `pinholes`, and the pieces of
    `slivers`. Pinholes and slivers are reported only if there are more than `PINHOLES_A_MILLION` or `SLIVERS_A_MILLION`
    in a million pixels.

    Args:
        town: the town under test.
        samples: number of samples that are rendered.
    """
    world, _ = town.first_world
    planner = _planner(world, samples)
    problems: list[str] = []
    holes: list[str] = []
    strips: list[str] = []
    for index in range(samples):
        record = planner.plan(index)
        placed = world.place(record)
        view, camera = _truth(world, placed, record), record.cameras[0]
        is_ground = np.isin(np.append(placed.geoms.label_code, 0)[view.geom_id], GROUND_CODES)
        is_open = (view.geom_id < 0) & (np.arange(camera.height_px)[:, None] > camera.height_px / 2 + 1)
        count, number = cv2.connectedComponents(is_open.astype(np.uint8), connectivity=8)
        for crack in range(1, count):
            around = cv2.dilate((number == crack).astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
            rim = around & (number != crack)
            if is_ground[rim].all():
                row, column = (int(places[0]) for places in np.nonzero(rim))
                point_m = camera.intrinsics.unproject([column, row], float(view.depth_m[row, column]))
                x_m, y_m, _ = camera.world_from_camera_transform.apply(point_m)
                problems.append(f"scene {record.scene}, sample {index}: the sky shows near ({x_m:.1f}, {y_m:.1f})")
        labels = np.append(placed.geoms.label_code, NOTHING)[view.geom_id]
        for row, column in pinholes(labels, view.depth_m).tolist():
            through = "the sky" if view.geom_id[row, column] < 0 else LABELS[labels[row, column]].name
            within = LABELS[labels[row, column - 1]].name
            point_m = camera.intrinsics.unproject([column - 1, row], float(view.depth_m[row, column - 1]))
            x_m, y_m, z_m = camera.world_from_camera_transform.apply(point_m)
            holes.append(
                f"scene {record.scene}, sample {index}: {through} shows through {within} "
                f"near ({x_m:.1f}, {y_m:.1f}, {z_m:.1f})"
            )
        for row, column in slivers(labels).tolist():
            point_m = camera.intrinsics.unproject([column, row], float(view.depth_m[row, column]))
            x_m, y_m, z_m = camera.world_from_camera_transform.apply(point_m)
            strips.append(
                f"scene {record.scene}, sample {index}: a thin strip of ground is seen between other surfaces "
                f"near ({x_m:.1f}, {y_m:.1f}, {z_m:.1f})"
            )
    millions = samples * RIG.cameras[0].width_px * RIG.cameras[0].height_px / 1e6
    problems += holes if len(holes) > PINHOLES_A_MILLION * millions else []
    return problems + (strips if len(strips) > SLIVERS_A_MILLION * millions else [])


def pinholes(label_code: npt.NDArray[np.uint8], depth_m: FloatImage) -> npt.NDArray[np.int64]:
    """Single pixels through which something farther is visible amid one closed surface: cracks between meshes.

    Args:
        label_code: (H, W) codes of labels, `NOTHING` for the sky.
        depth_m: (H, W) depth along the camera's axis, NaN for the sky.

    Returns:
        (N, 2) rows and columns. All eight neighbours of such a pixel have one label of `CLOSED`, and their depths are
        within `SURFACE_RATIO`; the pixel has another label and is farther than all of them by more than that ratio.
    """
    depths = np.nan_to_num(depth_m, nan=np.inf)
    steps = [(dy, dx) for dy in (0, 1, 2) for dx in (0, 1, 2) if (dy, dx) != (1, 1)]
    height, width = label_code.shape
    around = [np.s_[dy : height - 2 + dy, dx : width - 2 + dx] for dy, dx in steps]
    first, inner = label_code[around[0]], np.s_[1:-1, 1:-1]
    is_hole = np.isin(first, list(CLOSED)) & (label_code[inner] != first)
    nearest, farthest = depths[around[0]].copy(), depths[around[0]].copy()
    for part in around:
        is_hole &= label_code[part] == first
        np.minimum(nearest, depths[part], out=nearest)
        np.maximum(farthest, depths[part], out=farthest)
    is_hole &= (farthest < SURFACE_RATIO * nearest) & (depths[inner] > SURFACE_RATIO * farthest)
    return np.argwhere(is_hole) + 1


def open_backs(town: TownUnderTest, samples: int) -> list[str]:
    """One line for each small piece of sky amid closed surfaces that is no gap: a ray through it hits a geom.

    Renderers draw no surface from behind. If a face is missing, such as the underside of a roof, the sky is seen there,
    through the back of what lies behind. A real gap between surfaces, through which a ray hits nothing, is no problem.
    The pieces are reported only if there are more than `BACKS_A_MILLION` in a million pixels of the first scene.

    Args:
        town: the town under test.
        samples: number of samples that are rendered.
    """
    world, _ = town.first_world
    planner = _planner(world, samples, LARGE_RIG)
    problems = []
    for index in range(samples):
        record = planner.plan(index)
        placed = world.place(record)
        camera, rays = record.cameras[0], _rays(placed)
        pose = camera.world_from_camera_transform
        labels = np.append(placed.geoms.label_code, NOTHING)[_truth(world, placed, record).geom_id]
        for row, column in slivers(labels, NOTHING).tolist():
            along = np.ascontiguousarray(pose.rotation @ camera.intrinsics.unproject([column, row], 1.0))
            distance_m, geom = rays.first_hit(pose.translation_m, along)
            if geom >= 0:
                x_m, y_m, z_m = pose.translation_m + distance_m * along
                problems.append(
                    f"scene {record.scene}, sample {index}: the sky shows through the back of {_named(rays, geom)} "
                    f"near ({x_m:.1f}, {y_m:.1f}, {z_m:.1f})"
                )
    millions = samples * LARGE_RIG.cameras[0].width_px * LARGE_RIG.cameras[0].height_px / 1e6
    return problems if len(problems) > BACKS_A_MILLION * millions else []


def slivers(label_code: npt.NDArray[np.uint8], of: int = GROUND) -> npt.NDArray[np.int64]:
    """Pieces of one label of a few pixels amid closed surfaces, such as a thin strip of yard along the foot of a wall.

    Args:
        label_code: (H, W) codes of labels, `NOTHING` for the sky.
        of: code of the label of the pieces, `ground` by default.

    Returns:
        (N, 2) row and column of the first pixel of each piece. A piece has at most `SLIVER_PX` pixels, and all pixels
        around it have labels of `CLOSED`.
    """
    count, number, stats, _ = cv2.connectedComponentsWithStats((label_code == of).astype(np.uint8), connectivity=8)
    found = []
    for piece in range(1, count):
        left, top, width, height, area = stats[piece].tolist()
        if area > SLIVER_PX:
            continue
        part = np.s_[max(top - 1, 0) : top + height + 1, max(left - 1, 0) : left + width + 1]
        is_piece = number[part] == piece
        if np.isin(label_code[part][~is_piece], list(CLOSED)).all():
            found.append((top, left + int(np.flatnonzero(number[top, left : left + width] == piece)[0])))
    return np.array(found, np.int64).reshape(-1, 2)


def disagreement(town: TownUnderTest, min_agreement: float) -> list[str]:
    """One line if too few pixels of a rendered sample have the id and depth of a ray through their centre.

    Up to 400 random pixels away from edges are compared.

    Args:
        town: the town.
        min_agreement: smallest share of the pixels that must agree, 0..1.
    """
    world, _ = town.first_world
    record = _planner(world, 1).plan(0)
    placed = world.place(record)
    view = _truth(world, placed, record)
    camera, rays = record.cameras[0], _rays(placed)
    pose = camera.world_from_camera_transform
    inner = np.ones(view.geom_id.shape, bool)
    for axis in (0, 1):
        for step in (-1, 1):
            inner &= view.geom_id == np.roll(view.geom_id, step, axis=axis)
    rows, columns = np.nonzero(inner[1:-1, 1:-1])
    chosen = derive_rng(0, "town contract").permutation(len(rows))[:PIXELS]
    wrong: dict[tuple[str, str], int] = {}
    for row, column in zip(rows[chosen] + 1, columns[chosen] + 1, strict=True):
        along = pose.rotation @ camera.intrinsics.unproject([column, row], 1.0)
        distance_m, geom = rays.first_hit(pose.translation_m, np.ascontiguousarray(along))
        pixel_id, depth_m = int(view.geom_id[row, column]), float(view.depth_m[row, column])
        if pixel_id != geom or (geom >= 0 and abs(depth_m / distance_m - 1) > DEPTH_TOLERANCE):
            pair = (
                f"{_named(rays, pixel_id)} at {depth_m:.2f} m" if pixel_id >= 0 else "nothing",
                f"{_named(rays, geom)} at {distance_m:.2f} m" if geom >= 0 else "nothing",
            )
            wrong[pair] = wrong.get(pair, 0) + 1
    share = 1 - sum(wrong.values()) / max(1, len(chosen))
    if share >= min_agreement:
        return []
    common = sorted(wrong, key=lambda pair: -wrong[pair])[:3]
    examples = "; ".join(f"rendered {pixel}, hit {ray}" for pixel, ray in common)
    return [f"scene {record.scene}: only {share:.1%} of {len(chosen)} pixels agree with rays ({examples})"]


@dataclass(frozen=True, slots=True)
class _Truth:
    """Geom ids and depth of one view, rendered by the classic renderer."""

    geom_id: IdImage
    depth_m: FloatImage


def _truth(world: World, placed: PlacedStage, record: SceneRecord) -> _Truth:
    """Renders ids and depth of a sample with the classic renderer."""
    renderer = open_renderer("classic", world.model, quality="fast")
    try:
        (view,) = renderer.render(placed.stage, record.cameras, colour=False)
    finally:
        renderer.close()
    return _Truth(view.geom_id, view.depth_m)


def _planner(world: World, samples: int, rig: Rig = RIG) -> ScenePlanner:
    return ScenePlanner(world, rig, SplitConfig(seed=0, samples=samples), split_name="debug")


def _hidden_faces(world: World, record: SceneRecord, min_visible: float) -> list[str]:
    placed, camera = world.place(record), record.cameras[0]
    rays, eye_m = _rays(placed), camera.world_from_camera_transform.translation_m
    camera_from_world = camera.world_from_camera_transform.inverse()
    u, v = np.meshgrid(*((np.arange(count) + 0.5) / count - 0.5 for count in FACE_GRID))
    problems = []
    for face, surface in zip(world.faces, record.surfaces, strict=True):
        local_m = np.stack([u * face.width_m, v * face.height_m, np.zeros(u.shape)], axis=-1).reshape(-1, 3)
        points_m = record.world_from_surface(surface).apply(local_m)
        camera_m = camera_from_world.apply(points_m)
        pixels = camera.intrinsics.project(camera_m)
        inside = (camera_m[:, 2] > 0) & np.all(
            (pixels > -0.5) & (pixels < (camera.width_px - 0.5, camera.height_px - 0.5)), axis=1
        )
        seen = sum(rays.first_hit(eye_m, point_m - eye_m)[1] == face.geom_id for point_m in points_m[inside])
        share = seen / len(points_m)
        if share < min_visible:
            problems.append(
                f"scene {record.scene}: {face.name} shows only {share:.0%} of itself in sample {record.index}"
            )
    return problems


def _rays(placed: PlacedStage) -> Rays:
    return Rays(placed.stage.model, placed.stage.data, VISIBLE_GROUPS)


def _named(rays: Rays, geom: int) -> str:
    return repr(rays.name(geom))
