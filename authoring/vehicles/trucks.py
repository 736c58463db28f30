"""Lorries: a cab-over cab on a chassis that carries a box or a flat bed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from authoring.mesh import Mesh, bevelled_box, box, merge, revolve, write_obj
from authoring.vehicles.atlas import DETAILS, LAMPS, flat
from authoring.vehicles.car import build_car, side_lines
from authoring.vehicles.car_inside import look_inside
from authoring.vehicles.finish import Box, Finish, PaintMap, write_vehicle
from authoring.vehicles.fittings import (
    PLATE_SIZE_M,
    WHOLE,
    add_handles,
    add_mirrors,
    add_plate,
    add_wipers,
    panel,
)
from authoring.vehicles.grooves import Line
from authoring.vehicles.heavy import CAB
from authoring.vehicles.parts import Parts
from authoring.vehicles.wheels import WheelSpec, make_wheel

__all__ = ["FACE_SIZE_M", "write_box_truck", "write_flatbed"]

FACE_SIZE_M = (2.4, 1.2)
_CAB_X = 3.05
_REAR_AXLE_X = -2.05
_REAR_X = -4.0
_BED_Z = 1.02


def write_box_truck(out: Path) -> None:
    """A rigid lorry with a closed box; its rear doors carry the patch."""
    parts, side = _chassis()
    low, high, width, front = _BED_Z, 3.46, 2.48, 1.98
    middle = ((front + _REAR_X + 0.03) / 2, 0.0, (low + high) / 2)
    size = (front - _REAR_X - 0.03, width, high - low)
    parts.add("body", bevelled_box(size, 0.025, 1, middle))
    # Aluminium rails frame the box, as on real ones.
    for z in (low + 0.05, high - 0.04):
        parts.add("chrome", box((size[0] + 0.01, 0.02, 0.10), (middle[0], width / 2 + 0.005, z)), both_sides=True)
    for x in (front - 0.06, _REAR_X + 0.09):
        parts.add("chrome", box((0.10, 0.02, size[2]), (x, width / 2 + 0.006, middle[2])), both_sides=True)
    _rear_doors(parts, low, high, width)
    half_w, half_h = FACE_SIZE_M[0] / 2, FACE_SIZE_M[1] / 2
    face_x, face_z = _REAR_X - 0.02, 2.27
    face = Mesh.of(
        [[0, half_w, -half_h], [0, -half_w, -half_h], [0, -half_w, half_h], [0, half_w, half_h]],
        [[0, 1, 2], [0, 2, 3]],
        [[0, 0], [1, 0], [1, 1], [0, 1]],
    ).translated(face_x, 0, face_z)
    folder = out / "truck_box"
    folder.mkdir(parents=True, exist_ok=True)
    write_obj(folder / "face.obj", face)
    Image.fromarray(np.full((256, 512, 3), 205, dtype=np.uint8)).save(folder / "face.png", optimize=True)
    lines = (
        '    <mesh class="seen" name="face" file="truck_box/face.obj"/>\n'
        '    <texture name="face" type="2d" file="truck_box/face.png" colorspace="sRGB"/>\n'
        '    <material name="face" texture="face" metallic="0" roughness="0.9"/>',
        '      <geom class="truck.face" name="face" mesh="face" material="face"/>',
        f'      <site name="surface" pos="{face_x:g} 0 {face_z:g}" xyaxes="0 -1 0  0 0 -1" size="0.02" group="4"/>',
    )
    boxes = (
        Box((0.95, 1.13, 1.14), (_CAB_X, 0, 1.56)),
        Box((size[0] / 2 + 0.02, width / 2, (high - 0.45) / 2), (middle[0], 0, (high + 0.45) / 2)),
    )
    comment = "The box's rear doors carry the patch: geom `face`, site `surface`."
    _write(out, "truck_box", parts, side, boxes, comment, lines)


def write_flatbed(out: Path) -> None:
    """A rigid lorry with a wooden deck and low drop sides, loaded with pallets of crates."""
    parts, side = _chassis()
    front, width = 1.95, 2.44
    length, middle_x = front - _REAR_X, (front + _REAR_X) / 2
    deck = box((length, width, 0.10), (middle_x, 0, _BED_Z))
    parts.add("trim", flat(deck, DETAILS["wood"]))
    panels = 3
    for k in range(panels):
        span = length / panels
        x = _REAR_X + span * (k + 0.5)
        board = bevelled_box((span - 0.06, 0.035, 0.42), 0.012, 1, (x, width / 2, _BED_Z + 0.25))
        parts.add("body", board, both_sides=True)
        for rib in (0.12, 0.30):
            bar = box((span - 0.10, 0.012, 0.03), (x, width / 2 + 0.02, _BED_Z + 0.06 + rib))
            parts.add("body", bar, both_sides=True)
        post = box((0.06, 0.06, 0.46), (_REAR_X + span * k + 0.03, width / 2, _BED_Z + 0.24))
        parts.add("trim", flat(post, DETAILS["plastic"]), both_sides=True)
    parts.add("body", bevelled_box((0.035, width, 0.42), 0.012, 1, (_REAR_X + 0.02, 0, _BED_Z + 0.25)))
    parts.add("body", bevelled_box((0.06, width, 1.25), 0.015, 1, (front, 0, _BED_Z + 0.62)))
    for x, y, height, cell in (
        (1.15, 0.55, 0.95, "wood"), (1.15, -0.55, 0.75, "wood"), (-0.05, 0.0, 1.05, "white"),
        (-1.35, 0.5, 0.8, "wood"), (-1.35, -0.55, 1.0, "silver"), (-2.7, -0.1, 0.62, "wood"),
    ):  # fmt: skip
        crate = bevelled_box((1.05, 0.95, height), 0.02, 1, (x, y, _BED_Z + 0.19 + height / 2))
        parts.add("trim", flat(crate, DETAILS[cell]))
        parts.add("trim", flat(box((1.15, 1.0, 0.12), (x, y, _BED_Z + 0.11)), DETAILS["wood"]))
    boxes = (
        Box((0.95, 1.13, 1.14), (_CAB_X, 0, 1.56)),
        Box((length / 2, width / 2, 0.9), (middle_x, 0, 1.35)),
    )
    _write(out, "truck_rigid", parts, side, boxes, "A flat bed with drop sides and a load.", None, shown=1)


def _chassis() -> tuple[Parts, tuple[Line, ...]]:
    """Cab, frame, tanks, guards, wheels and number plates of an eight-metre lorry.

    Returns:
        The parts, and the shut lines of the cab's sides.
    """
    local, body, cabin = build_car(CAB)
    look_inside(local, cabin)
    front = cabin.side.patch.evaluate(np.array([[cabin.corners[0], 0.2]]))[0]
    assert CAB.mirror is not None
    add_mirrors(local, cabin, float(front[0]) - 0.14, float(front[2]) + 0.10, size=CAB.mirror, paint="trim")
    add_handles(local, body, CAB.handles)
    add_plate(local, body, CAB.plates[0], True, stand_off=0.03)
    add_wipers(local, cabin)
    parts = Parts()
    for part, meshes in local.meshes.items():
        for mesh in meshes:
            parts.add(part, mesh.translated(_CAB_X, 0, 0))

    def dark(mesh: Mesh, both_sides: bool = False) -> None:
        parts.add("trim", flat(mesh, DETAILS["plastic"]), both_sides=both_sides)

    dark(box((7.0, 0.10, 0.26), (-0.30, 0.42, 0.80)), True)
    dark(box((0.9, 1.9, 0.42), (_CAB_X - 0.55, 0, 0.88)))
    for x in (1.4, 0.2, -1.0, -3.2):
        dark(box((0.08, 2.3, 0.10), (x, 0, 0.92)))
    tank = revolve([(0.0, 0.0), (0.27, 0.0), (0.27, 0.95), (0.0, 0.95)], 16, "x")
    parts.add("rim", tank.translated(0.95, 0.90, 0.64))
    dark(bevelled_box((0.75, 0.42, 0.42), 0.03, 1, (1.35, -0.92, 0.66)))
    for z in (0.52, 0.78):
        rail = box((1.9, 0.03, 0.09), (-0.35, 1.18, z))
        parts.add("rim", rail, both_sides=True)
    dark(bevelled_box((0.10, 2.3, 0.12), 0.02, 1, (_REAR_X + 0.20, 0, 0.50)))
    for y in (0.55, -0.55):
        dark(box((0.06, 0.08, 0.40), (_REAR_X + 0.24, y, 0.70)))
    lamp = panel(0.44, 0.13, (_REAR_X + 0.10, 0.86, 0.78), 180, LAMPS["tail_block"])
    parts.add("lights", lamp, both_sides=True)
    dark(box((0.08, 0.50, 0.18), (_REAR_X + 0.145, 0.86, 0.78)), True)
    parts.add("plate", panel(*PLATE_SIZE_M, (_REAR_X + 0.10, 0, 0.78), 180, WHOLE))
    dark(box((0.05, 0.58, 0.16), (_REAR_X + 0.13, 0, 0.78)))
    for x in (0.6, -0.9, -3.3):
        marker = box((0.09, 0.012, 0.035), (x, 1.235, 0.93))
        parts.add("lights", flat(marker, LAMPS["amber"]), both_sides=True)
    dark(box((0.02, 0.52, 0.42), (_REAR_AXLE_X - 0.62, 0.90, 0.52)), True)
    spec = WheelSpec(0.42, 0.25, 0.25, 0, dish=0.11)
    wheel = make_wheel(spec)
    for y, shown in ((0.98, True), (0.70, False)):
        at = (_REAR_AXLE_X, y, spec.radius)
        parts.add("tyre", wheel.tyre.translated(*at), both_sides=True)
        if shown:
            parts.add("rim", wheel.rim.translated(*at), both_sides=True)
            parts.add("trim", flat(wheel.drum.translated(*at), DETAILS["gloss"]), both_sides=True)
    dark(revolve([(0.09, -0.9), (0.09, 0.9)], 10, "y").translated(_REAR_AXLE_X, 0, spec.radius))
    return parts, tuple(tuple((x + _CAB_X, z) for x, z in line) for line in side_lines(CAB, cabin))


def _rear_doors(parts: Parts, low: float, high: float, width: float) -> None:
    x = _REAR_X
    leaf = (width - 0.10) / 2
    for y in (-leaf / 2 - 0.005, leaf / 2 + 0.005):
        door = bevelled_box((0.035, leaf - 0.01, high - low - 0.12), 0.008, 1, (x + 0.018, y, (low + high) / 2))
        parts.add("body", door)
    for y in (0.10, leaf - 0.22):
        bar = revolve([(0.016, low + 0.04), (0.016, high - 0.04)], 8, "z").translated(x - 0.004, y, 0)
        # The bars pass behind the printed board, so they stop above and below it.
        parts.add("chrome", _cut_bar(bar, 1.66, 2.88), both_sides=True)
    for z in (low + 0.18, low + 0.55, high - 0.22):
        hinge = box((0.03, 0.16, 0.05), (x - 0.005, width / 2 - 0.10, z))
        parts.add("chrome", hinge, both_sides=True)
    frame = 0.06
    for z in (low + 0.03, high - 0.03):
        parts.add("chrome", box((0.05, width, frame), (x + 0.022, 0, z)))
    upright = box((0.05, frame, high - low), (x + 0.022, width / 2 - 0.028, (low + high) / 2))
    parts.add("chrome", upright, both_sides=True)
    board = box((0.012, FACE_SIZE_M[0] + 0.04, FACE_SIZE_M[1] + 0.04), (x - 0.005, 0, 2.27))
    parts.add("trim", flat(board, DETAILS["plastic"]))
    for y, cell in ((1.08, "red"), (0.95, "red")):
        parts.add("lights", flat(box((0.02, 0.10, 0.04), (x - 0.005, y, high - 0.03)), LAMPS[cell]), both_sides=True)
    parts.add("trim", panel(0.50, 0.14, (x - 0.008, 0.80, low + 0.26), 180, DETAILS["stripe"]), both_sides=True)


def _cut_bar(bar: Mesh, low: float, high: float) -> Mesh:
    """Two stubs of an upright bar: below `low` and above `high`."""
    bottom, top = bar.vertices.copy(), bar.vertices.copy()
    bottom[:, 2], top[:, 2] = np.minimum(bottom[:, 2], low), np.maximum(top[:, 2], high)
    return merge([Mesh(bottom, bar.faces, bar.uvs), Mesh(top, bar.faces, bar.uvs)])


def _write(
    out: Path,
    name: str,
    parts: Parts,
    side: tuple[Line, ...],
    boxes: tuple[Box, ...],
    comment: str,
    face: tuple[str, str, str] | None,
    shown: int = 0,
) -> None:
    meshes = parts.merged()
    bounds = meshes["paint"].bounds
    paint = PaintMap(bounds[0], bounds[1], (512, 512), side, (), CAB.lines_front)
    finish = Finish(name, "truck", "truck", boxes, comment=comment, shown=shown)
    write_vehicle(out, finish, meshes, paint, face=face)
