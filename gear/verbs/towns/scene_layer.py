"""The scene layer of a town map: boards, and the areas in which the road users of a scene may be."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from gear.values.geometry import Array
from gear.verbs.towns.canvas import Canvas, Colour
from gear.world.assets.library import AssetLibrary
from gear.world.scene_spec import BoardSpec, NpcLimits, Range, SceneSpec
from gear.world.surfaces.face_size import asset_face_size_m

PALETTE: tuple[Colour, ...] = (
    (200, 30, 60), (20, 110, 190), (20, 140, 70), (150, 60, 170), (225, 110, 0), (0, 140, 150), (165, 85, 30),
    (215, 60, 150), (95, 100, 20), (70, 70, 190),
)  # fmt: skip
INK: Colour = (34, 34, 40)
WHITE: Colour = (255, 255, 255)

WEDGE_M = 26.0
WEDGE_HALF_DEG = 30.0
BOARD_PX = 4.0
EGO_PX, VEHICLES_PX, PEOPLE_PX = 1.8, 1.1, 1.0
NAME_PX = 10.0
BEHIND_NUMBER_PX = 12.0
CLEAR_M = 3.0

Box = tuple[float, float, float, float]
"""A rectangle as (x of its centre, y of its centre, half width, half height), in pixels."""


def scene_colours(scenes: Mapping[str, SceneSpec]) -> dict[str, Colour]:
    """Returns the colours in which scenes with boards are drawn, by the scene's name."""
    with_boards = [name for name, scene in scenes.items() if scene.boards]
    return {name: PALETTE[number % len(PALETTE)] for number, name in enumerate(with_boards)}


def draw_limits(canvas: Canvas, scene: SceneSpec, colour: Colour) -> None:
    """Outlines the areas in which the ego car, vehicles and people of a scene may be.

    Args:
        canvas: the town map.
        scene: the scene with its areas.
        colour: RGB, 0..255.
    """
    board = scene.boards[0]
    outline = limits_outline_m(board, scene.npc_vehicles)
    if outline is not None:
        canvas.dashes(canvas.to_px(outline), colour, VEHICLES_PX, dash_px=9.0, gap_px=5.0, closed=True)
    outline = limits_outline_m(board, scene.pedestrians)
    if outline is not None:
        canvas.dashes(canvas.to_px(outline), colour, PEOPLE_PX, dash_px=1.5, gap_px=3.5, closed=True)
    if scene.ego is not None:
        ego = canvas.to_px(board_rectangle_m(board, scene.ego.ahead_m, scene.ego.lateral_m))
        canvas.fill(ego, colour, 0.22)
        canvas.line(ego, colour, EGO_PX, closed=True)


def draw_boards(canvas: Canvas, library: AssetLibrary, scene: SceneSpec, colour: Colour) -> None:
    """Draws each board of a scene, and a wedge in the direction that the board faces; several boards are numbered.

    Args:
        canvas: the town map.
        library: files of the assets.
        scene: the scene with its boards.
        colour: RGB, 0..255.

    Raises:
        TownError: the file of a board cannot be compiled, or the board has no face (the rectangle for the patch).
    """
    for number, board in enumerate(scene.boards):
        centre = canvas.to_px(board.position_m)[0]
        facing = math.radians(board.facing_deg)
        turns = facing + np.radians(np.linspace(-WEDGE_HALF_DEG, WEDGE_HALF_DEG, 13))
        rim = centre + WEDGE_M * canvas.px_per_m * np.stack([np.cos(turns), -np.sin(turns)], axis=1)
        canvas.fill(np.concatenate([centre[None], rim]), colour, 0.35)
        half = _face_width_m(library, board) / 2 * np.array([-math.sin(facing), math.cos(facing)])
        ends = canvas.to_px(np.array(board.position_m[:2]) + np.stack([half, -half]))
        canvas.line(ends, INK, BOARD_PX + 2.0)
        canvas.line(ends, colour, BOARD_PX)
        if len(scene.boards) > 1:
            x, y = centre - BEHIND_NUMBER_PX * np.array([math.cos(facing), -math.sin(facing)])
            canvas.text((x, y + 4.0), str(number), 8.0, colour, anchor="middle", bold=True, halo=WHITE)


def draw_names(canvas: Canvas, scenes: Mapping[str, SceneSpec], colours: Mapping[str, Colour]) -> None:
    """Writes the name of each scene near its first board, at a position away from boards and other names.

    Args:
        canvas: the town map.
        scenes: scenes by name.
        colours: RGB, 0..255, of each scene.
    """
    clear_px = max(12.0, CLEAR_M * canvas.px_per_m)
    boards = [board for name in colours for board in scenes[name].boards]
    taken: list[Box] = [(*canvas.to_px(board.position_m)[0], clear_px, clear_px) for board in boards]
    for name, colour in colours.items():
        board = scenes[name].boards[0]
        half_px = (canvas.text_width_px(name, NAME_PX, bold=True) / 2 + 5.0, 9.0)
        spot = min(_spots(canvas, board, half_px), key=lambda spot: sum(_overlap_px2(spot, other) for other in taken))
        taken.append(spot)
        x, y = spot[:2]
        tag = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * half_px + (x, y)
        canvas.fill(tag, WHITE)
        canvas.line(tag, colour, 1.2, closed=True)
        canvas.text((x, y + NAME_PX / 2), name, NAME_PX, colour, anchor="middle", bold=True)


def _spots(canvas: Canvas, board: BoardSpec, half_px: tuple[float, float]) -> list[Box]:
    """Returns candidate positions of a name inside the map, the best first: behind its board, around it, further
    away.
    """
    x, y = canvas.to_px(board.position_m)[0]
    left, top, right, bottom = canvas.box_px
    spots = []
    for away_px in (18.0, 30.0, 46.0, 70.0):
        for turn_deg in (180, 135, 225, 90, 270, 45, 315, 0):
            turn = math.radians(board.facing_deg + turn_deg)
            reach = np.array([math.cos(turn) * (half_px[0] + away_px), -math.sin(turn) * (half_px[1] + away_px)])
            spot_x = min(max(x + reach[0], left + half_px[0] + 4), right - half_px[0] - 4)
            spot_y = min(max(y + reach[1], top + half_px[1] + 4), bottom - half_px[1] - 4)
            spots.append((spot_x, spot_y, *half_px))
    return spots


def _overlap_px2(first: Box, second: Box) -> float:
    width, height = (
        min(first[i] + first[i + 2], second[i] + second[i + 2])
        - max(first[i] - first[i + 2], second[i] - second[i + 2])
        for i in (0, 1)
    )
    return max(0.0, width) * max(0.0, height)


def limits_outline_m(board: BoardSpec, limits: NpcLimits) -> Array | None:
    """Returns the (4, 2) corners in the world of an area that is defined relative to a board; None if the area is not
    relative to a board.

    Args:
        board: the board (billboard) to which the area is relative.
        limits: where vehicles or people may stand; bounds that are not given are 10 km away.
    """
    if not limits.needs_board:
        return None
    return board_rectangle_m(board, limits.ahead_m or (-1e4, 1e4), limits.lateral_m or (-1e4, 1e4))


def board_rectangle_m(board: BoardSpec, ahead_m: Range, lateral_m: Range) -> Array:
    """Returns the (4, 2) corners in the world of a rectangle that is defined relative to a board, in metres.

    Args:
        board: the board.
        ahead_m: range in the direction that the board faces.
        lateral_m: range to the left of that direction.
    """
    facing = math.radians(board.facing_deg)
    along, left = np.array([math.cos(facing), math.sin(facing)]), np.array([-math.sin(facing), math.cos(facing)])
    corners = [(a, b) for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
    return np.array([np.array(board.position_m[:2]) + ahead_m[a] * along + lateral_m[b] * left for a, b in corners])


def _face_width_m(library: AssetLibrary, board: BoardSpec) -> float:
    """Returns the width in metres of the face, the rectangle of a board that shows the patch.

    It is the width in the scene, or that in the board's file if the scene gives none.

    Raises:
        TownError: the board's file cannot be compiled or has no face.
    """
    if board.size_m is not None:
        return board.size_m[0]
    return asset_face_size_m(library.path("surface", board.asset))[0]
