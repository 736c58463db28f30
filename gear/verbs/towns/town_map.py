"""A top-down map of a town: streets, buildings, lanes with directions, and the boards and areas of its scenes."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from gear.values.frames import UInt8Image
from gear.verbs.towns import ground_layer, traffic_layer
from gear.verbs.towns.canvas import Canvas, round_step_m
from gear.verbs.towns.facts import Town
from gear.verbs.towns.legend import PANEL_PX, draw_legend, legend_height_px
from gear.verbs.towns.scene_layer import INK, draw_boards, draw_limits, draw_names, scene_colours
from gear.world.scene_spec import SceneSpec

LONG_SIDE_PX = 1800
MARGIN_PX = 64
PAPER = (255, 255, 255)
GREY = (120, 120, 126)
TICK_PX = 7.0


def draw_map(town: Town, geometry: ground_layer.TownGeometry) -> UInt8Image:
    """Draws the map of a town with all of its scenes.

    Args:
        town: the town with its lanes and scenes.
        geometry: the compiled geometry of the town.

    Returns:
        (H, W, 3) uint8 RGB.

    Raises:
        TownError: the file of a board is broken, or a geom of the town has no triangles.
    """
    scenes: Mapping[str, SceneSpec] = {} if town.scenes is None else town.scenes.scenes
    xmin, _, _, ymax = town.lanes.bounds_m
    px_per_m = LONG_SIDE_PX / max(town.size_m)
    width_px, height_px = (round(side * px_per_m) for side in town.size_m)
    sheet_px = max(height_px + 2 * MARGIN_PX, legend_height_px(len(scenes)))
    top_px = (sheet_px - height_px) // 2
    canvas = Canvas(
        (width_px + 2 * MARGIN_PX + PANEL_PX, sheet_px),
        PAPER,
        px_per_m=px_per_m,
        origin_px=(MARGIN_PX - xmin * px_per_m, top_px + ymax * px_per_m),
        box_px=(MARGIN_PX, top_px, MARGIN_PX + width_px, top_px + height_px),
    )
    ground_layer.draw_ground(canvas, geometry, town.lanes.bounds_m)
    traffic_layer.draw_traffic(canvas, town.lanes)
    colours = scene_colours(scenes)
    for name, colour in colours.items():
        draw_limits(canvas, scenes[name], colour)
    for name, colour in colours.items():
        draw_boards(canvas, town.library, scenes[name], colour)
    draw_names(canvas, scenes, colours)
    canvas.clip(PAPER)
    _draw_frame(canvas, town)
    draw_legend(canvas, town, colours)
    return canvas.picture()


def _draw_frame(canvas: Canvas, town: Town) -> None:
    xmin, ymin, xmax, ymax = town.lanes.bounds_m
    left, top, right, bottom = canvas.box_px
    canvas.line([[left, top], [right, top], [right, bottom], [left, bottom]], INK, 1.4, closed=True)
    step_m = round_step_m(max(town.size_m), 10)
    for x_m in np.arange(math.ceil(xmin / step_m), math.floor(xmax / step_m) + 1) * step_m:
        x = float(canvas.to_px([x_m, 0.0])[0, 0])
        canvas.line([[x, bottom], [x, bottom + TICK_PX]], INK, 1.2)
        canvas.text((x, bottom + 26), f"{x_m:g}", 10, GREY, anchor="middle")
    for y_m in np.arange(math.ceil(ymin / step_m), math.floor(ymax / step_m) + 1) * step_m:
        y = float(canvas.to_px([0.0, y_m])[0, 1])
        canvas.line([[left - TICK_PX, y], [left, y]], INK, 1.2)
        canvas.text((left - 12, y + 5), f"{y_m:g}", 10, GREY, anchor="right")
    canvas.text((right, bottom + 50), "x, m east", 10, GREY, anchor="right")
    canvas.text((left - 12, top - 14), "y, m north", 10, GREY, anchor="left")
