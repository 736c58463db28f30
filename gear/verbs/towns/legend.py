"""The panel to the right of a town map: title, legend, list of scenes, scale bar and north arrow."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping

import numpy as np

from gear.verbs.towns import ground_layer, traffic_layer
from gear.verbs.towns.canvas import Canvas, Colour, rectangle, round_step_m
from gear.verbs.towns.facts import Town
from gear.verbs.towns.scene_layer import EGO_PX, INK, PEOPLE_PX, VEHICLES_PX
from gear.world.scene_spec import NpcLimits, SceneSpec

PANEL_PX = 470
LINE_PX = 25.0
TEXT_PX = 11.0
SWATCH_PX = 42.0
MUTED: Colour = (96, 96, 104)
WRAP = 52

Draw = Callable[[Canvas, float, float], None]


def draw_legend(canvas: Canvas, town: Town, colours: Mapping[str, Colour]) -> None:
    """Draws the panel to the right of the map.

    Args:
        canvas: the map.
        town: the town.
        colours: colours of the scenes with boards, by the scene's name.
    """
    x, y = canvas.box_px[2] + 36.0, 70.0
    canvas.text((x, y + 8), town.name, 24, INK, bold=True)
    width_m, height_m = town.size_m
    y = _lines(canvas, x, y + 42, [
        f"{width_m:.0f} m x {height_m:.0f} m, {len(town.lanes.lanes)} lanes, {town.lane_km:.1f} km of lanes",
        f"{len(town.lanes.bays)} parking bays",
    ])  # fmt: skip
    y = _ground_signs(canvas, x, y + 14)
    y = _traffic_signs(canvas, x, y + 14, town)
    if town.scenes is not None:
        if colours:
            y = _limit_signs(canvas, x, y + 14)
        y = _scene_list(canvas, x, y + 14, town.scenes.scenes, colours)
    _scale_and_north(canvas, x, y + 10)


def legend_height_px(scenes: int) -> int:
    """Returns the height in pixels of the panel of a town with `scenes` scenes."""
    return 760 + 68 * scenes


def scene_note(scene: SceneSpec) -> str:
    """Returns one line about a scene: its boards or truck, and the numbers of vehicles and people."""
    if scene.truck is not None:
        what = f"{scene.truck.asset} in the ego car's lane, {_span(scene.truck.gap_m)} m ahead, on any road"
    elif scene.boards:
        what = "1 board" if len(scene.boards) == 1 else f"{len(scene.boards)} boards"
    else:
        what = "no board; the ego car on any road"
    vehicles = f"{_span(scene.npc_vehicles.count)} vehicles{_around(scene.npc_vehicles)}"
    return f"{what}; {vehicles}, {_span(scene.pedestrians.count)} people{_around(scene.pedestrians)}"


def _span(limits: tuple[float, float]) -> str:
    return f"{limits[0]:g}-{limits[1]:g}"


def _around(limits: NpcLimits) -> str:
    return f" within {limits.radius_m[1]:g} m" if limits.radius_m is not None else ""


def _lines(canvas: Canvas, x: float, y: float, lines: list[str], colour: Colour = MUTED) -> float:
    for line in lines:
        canvas.text((x, y), line, TEXT_PX, colour)
        y += LINE_PX * 0.88
    return y


def _heading(canvas: Canvas, x: float, y: float, words: str) -> float:
    canvas.text((x, y + TEXT_PX), words, TEXT_PX + 1, INK, bold=True)
    return y + LINE_PX + 6


def _rows(canvas: Canvas, x: float, y: float, rows: list[tuple[str, Draw]]) -> float:
    for words, draw in rows:
        draw(canvas, x, y)
        canvas.text((x + SWATCH_PX + 12, y + 11.5), words, TEXT_PX, INK)
        y += LINE_PX
    return y


def _swatch(fill: Colour, edge: Colour) -> Draw:
    def draw(canvas: Canvas, x: float, y: float) -> None:
        canvas.fill(rectangle(x, y, SWATCH_PX, 14), fill)
        canvas.line(rectangle(x, y, SWATCH_PX, 14), edge, 0.8, closed=True)

    return draw


def _fence(canvas: Canvas, x: float, y: float) -> None:
    canvas.line(rectangle(x, y + 5, SWATCH_PX, 4), ground_layer.FENCE, 0.8, closed=True)


def _ground_signs(canvas: Canvas, x: float, y: float) -> float:
    y = _heading(canvas, x, y, "Ground")
    edge = (170, 168, 164)
    rows = [(name, _swatch(colour, edge)) for name, _, colour in ground_layer.COVERS]
    rows.append(("vegetation", _swatch(_mixed(ground_layer.VEGETATION), edge)))
    rows.append(("building", _swatch(ground_layer.BUILDING, ground_layer.BUILDING_EDGE)))
    rows.append(("fence, low obstacle", _fence))
    middle = (len(rows) + 1) // 2
    left = _rows(canvas, x, y, rows[:middle])
    _rows(canvas, x + 200, y, rows[middle:])
    return left


def _mixed(colour: Colour) -> Colour:
    """The colour on the map, where it is drawn over terrain with half opacity."""
    base = ground_layer.COVERS[0][2]
    return tuple((a + b) // 2 for a, b in zip(colour, base, strict=True))  # type: ignore[return-value]


def _traffic_signs(canvas: Canvas, x: float, y: float, town: Town) -> float:
    def lane(colour: Colour, width_px: float) -> Draw:
        def draw(canvas: Canvas, x: float, y: float) -> None:
            canvas.line([[x, y + 7], [x + SWATCH_PX, y + 7]], colour, width_px)
            traffic_layer.lane_arrow(canvas, np.array([x + SWATCH_PX / 2, y + 7]), 0.0, 13.0, colour)

        return draw

    def walk(canvas: Canvas, x: float, y: float) -> None:
        ends = [[x, y + 7], [x + SWATCH_PX, y + 7]]
        canvas.dashes(ends, traffic_layer.WALK, traffic_layer.WALK_PX, dash_px=2.0, gap_px=3.0)

    def zebra(canvas: Canvas, x: float, y: float) -> None:
        canvas.fill(rectangle(x, y, SWATCH_PX, 14), ground_layer.COVERS[2][2])
        for stripe in range(5):
            canvas.fill(rectangle(x + 3 + 8 * stripe, y + 1.5, 4, 11), traffic_layer.STRIPE)

    def bay(canvas: Canvas, x: float, y: float) -> None:
        canvas.line(rectangle(x, y, SWATCH_PX, 14), traffic_layer.BAY, traffic_layer.BAY_PX, closed=True)
        canvas.fill([[x + 36, y + 7], [x + 26, y + 3.5], [x + 26, y + 10.5]], traffic_layer.BAY)

    rows: list[tuple[str, Draw]] = [
        ("lane", lane(traffic_layer.LANE, traffic_layer.LANE_PX)),
        ("junction lane", lane(traffic_layer.JUNCTION, traffic_layer.JUNCTION_PX)),
        ("sidewalk line", walk),
        ("crosswalk", zebra),
        ("parking bay", bay),
    ]
    y = _heading(canvas, x, y, "Road users keep to")
    left = _rows(canvas, x, y, rows[:3])
    _rows(canvas, x + 200, y, rows[3:])
    return left


def _limit_signs(canvas: Canvas, x: float, y: float) -> float:
    def ego(canvas: Canvas, x: float, y: float) -> None:
        canvas.fill(rectangle(x, y, SWATCH_PX, 14), INK, 0.22)
        canvas.line(rectangle(x, y, SWATCH_PX, 14), INK, EGO_PX, closed=True)

    def dashed(width_px: float, dash_px: float, gap_px: float) -> Draw:
        def draw(canvas: Canvas, x: float, y: float) -> None:
            corners = rectangle(x, y, SWATCH_PX, 14)
            canvas.dashes(corners, INK, width_px, dash_px=dash_px, gap_px=gap_px, closed=True)

        return draw

    def board(canvas: Canvas, x: float, y: float) -> None:
        canvas.fill([[x + 6, y + 7], [x + SWATCH_PX, y - 3], [x + SWATCH_PX, y + 17]], INK, 0.35)
        canvas.line([[x + 6, y - 2], [x + 6, y + 16]], INK, 5.0)

    y = _heading(canvas, x, y, "Scenes with boards, each in its colour")
    return _rows(canvas, x, y, [
        ("board, and where it faces", board),
        ("where the ego car may be", ego),
        ("where other vehicles may be", dashed(VEHICLES_PX, 9.0, 5.0)),
        ("where people may be", dashed(PEOPLE_PX, 1.5, 3.5)),
    ])  # fmt: skip


def _scene_list(
    canvas: Canvas, x: float, y: float, scenes: Mapping[str, SceneSpec], colours: Mapping[str, Colour]
) -> float:
    y = _heading(canvas, x, y, "Scenes")
    for name, scene in scenes.items():
        colour = colours.get(name, MUTED)
        canvas.dot((x + 5, y + 6), 5.0, colour)
        canvas.text((x + 20, y + 11), name, TEXT_PX, colour, bold=True)
        y = _lines(canvas, x + 20, y + 11 + LINE_PX * 0.8, textwrap.wrap(scene_note(scene), WRAP)) - 2
    return y


def _scale_and_north(canvas: Canvas, x: float, y: float) -> None:
    length_m = 2 * round_step_m(240.0 / canvas.px_per_m, 4)
    part_px = length_m * canvas.px_per_m / 4
    top = y + 34.0
    for part in range(4):
        block = rectangle(x + part * part_px, top, part_px, 8)
        canvas.fill(block, INK if part % 2 == 0 else (255, 255, 255))
        canvas.line(block, INK, 1.0, closed=True)
    for part in (0, 2, 4):
        canvas.text((x + part * part_px, top - 8), f"{length_m * part / 4:g}", TEXT_PX, INK, anchor="middle")
    canvas.text((x + 4 * part_px + 16, top + 9), "m", TEXT_PX, INK)
    north = np.array([x + 370.0, top + 6])
    canvas.fill(north + np.array([[0, -34], [-12, 14], [0, 5]]), INK)
    canvas.line(north + np.array([[0, -34], [12, 14], [0, 5]]), INK, 1.2, closed=True)
    canvas.text((north[0], north[1] - 42), "N", TEXT_PX + 3, INK, anchor="middle", bold=True)
