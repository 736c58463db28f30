"""Parts that are added to a body: mirrors, handles, number plates, wipers, rails, signs, exhausts."""

from __future__ import annotations

import numpy as np

from authoring.mesh import Mesh, bevelled_box, box, extrude, grid, revolve, rotation
from authoring.vehicles.atlas import DETAILS, LAMPS, Cell, cell_uvs, flat
from authoring.vehicles.parts import Parts
from authoring.vehicles.sheet import Sheet
from authoring.vehicles.shell import Shell, surface_point

__all__ = [
    "PLATE_SIZE_M",
    "WHOLE",
    "add_antenna",
    "add_badge",
    "add_exhaust",
    "add_handles",
    "add_light_bar",
    "add_mirrors",
    "add_plate",
    "add_rails",
    "add_roof_sign",
    "add_wipers",
    "panel",
]


PLATE_SIZE_M = (0.52, 0.112)
WHOLE = Cell(0.0, 0.0, 1.0, 1.0, (0.0, 0.0))


def panel(width: float, height: float, at: tuple[float, float, float], yaw_deg: float, cell: Cell) -> Mesh:
    """Returns an upright rectangle with a cell of the texture; it faces +x if `yaw_deg` is 0, and its middle is at
    `at`.
    """
    half_w, half_h = width / 2, height / 2
    sheet = Mesh.of(
        [[0, -half_w, -half_h], [0, half_w, -half_h], [0, half_w, half_h], [0, -half_w, half_h]],
        [[0, 1, 2], [0, 2, 3]],
        cell_uvs(cell, np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])),
    )
    return sheet.transformed(rotation("z", yaw_deg)).translated(*at)


def add_mirrors(
    parts: Parts, cabin: Shell, x: float, z: float, *, size: tuple[float, float, float] = (0.11, 0.20, 0.14),
    paint: str = "paint",
) -> None:  # fmt: skip
    """Adds door mirrors on short arms, beside the point (x, z) of the cabin."""
    point, _ = surface_point(cabin.side, x, z)
    y = point[1] + 0.06 + size[1] / 2
    bevel = min(size) * 0.3
    shell = bevelled_box(size, bevel, 1)
    # The housing narrows outwards and forwards like a drop.
    v = shell.vertices.copy()
    ahead = np.clip(0.5 + v[:, :1] / size[0], 0, 1)
    v[:, 1:] *= 1 - 0.28 * ahead
    v[:, 2] *= 1 - 0.18 * np.clip(v[:, 1] / size[1] + 0.5, 0, 1)
    housing = Mesh(v, shell.faces, shell.uvs, shell.normals)
    at = (x + 0.02, y, z + size[2] * 0.35)
    parts.add(paint, flat(housing, DETAILS["plastic"]).translated(*at), both_sides=True)
    wide, tall = size[1] - 2 * bevel, (size[2] - 2 * bevel) * 0.85
    glass = panel(wide, tall, (at[0] - size[0] / 2 - 0.003, at[1], at[2]), 180, DETAILS["silver"])
    parts.add("rim", glass, both_sides=True)
    arm = bevelled_box((0.06, y - point[1] + 0.06, 0.035), 0.012, 1, (x + 0.03, (y + point[1]) / 2 - 0.03, z + 0.005))
    parts.add("trim", flat(arm, DETAILS["plastic"]), both_sides=True)


def add_handles(parts: Parts, body: Shell, places: tuple[tuple[float, float], ...], material: str = "paint") -> None:
    """Adds door handles on both sides at positions (x, z)."""
    section = [(-0.016, -0.006), (0.016, -0.006), (0.016, 0.004), (0.008, 0.011), (-0.008, 0.011), (-0.016, 0.004)]
    upright = extrude(section, 0.17).translated(z=-0.085)
    grip = Mesh(upright.vertices[:, [2, 1, 0]], upright.faces[:, ::-1], upright.uvs)
    for x, z in places:
        point, normal = surface_point(body.side, x, z)
        lean = np.degrees(np.arctan2(normal[2], normal[1]))
        turn = rotation("x", lean)
        bar = grip.transformed(turn).translated(*(point + normal * 0.026))
        cup = box((0.13, 0.004, 0.055)).transformed(turn).translated(*(point + normal * 0.002))
        parts.add(material, flat(bar, DETAILS["plastic"]), both_sides=True)
        parts.add("trim", flat(cup, DETAILS["gloss"]), both_sides=True)


def add_plate(parts: Parts, body: Shell, z: float, front: bool, *, stand_off: float = 0.012) -> None:
    """Adds a number plate in its holder, in the middle of the front or the rear."""
    v = np.linspace(0, 1, 201)
    line = body.side.patch.evaluate(np.column_stack([np.full_like(v, 0.0 if front else 1.0), v]))
    nearest = int(np.abs(line[:, 2] - z).argmin())
    x = float(line[nearest, 0]) + (stand_off if front else -stand_off)
    yaw = 0.0 if front else 180.0
    parts.add("trim", flat(box((0.03, 0.54, 0.13), (x - 0.017 if front else x + 0.017, 0, z)), DETAILS["plastic"]))
    parts.add("plate", panel(*PLATE_SIZE_M, (x + (0.005 if front else -0.005), 0.0, z), yaw, WHOLE))


def add_wipers(parts: Parts, cabin: Shell, *, rise: float = 0.1) -> None:
    """Adds two wiper blades along the foot of the windscreen."""
    right = cabin.corners[0] * 0.92
    u_all = np.linspace(0, right, 200)
    for start, end in ((0.02, 0.62), (-0.62, -0.05)):
        share = np.linspace(start, end, 7)
        u = np.interp(np.abs(share), np.linspace(0, 1, 200), u_all)
        params = np.column_stack([u, rise * (0.6 + 0.5 * (share - start) / (end - start))])
        points, normals = cabin.side.patch.evaluate(params), cabin.side.patch.normals(params)
        flip = np.where(share < 0, -1.0, 1.0)
        points[:, 1] *= flip
        normals[:, 1] *= flip
        up = np.cross(normals, np.gradient(points, axis=0))
        up /= np.linalg.norm(up, axis=1, keepdims=True)
        base = points + normals * 0.012
        parts.add("trim", flat(grid(np.stack([base - up * 0.011, base + up * 0.011])).flipped(), DETAILS["rubber"]))


def _roof_z(sheet: Sheet, x: float, y: float) -> float:
    a, b = np.meshgrid(np.linspace(0, 1, 81), np.linspace(0, 1, 41), indexing="ij")
    points = sheet.patch.evaluate(np.stack([a.reshape(-1), b.reshape(-1)], axis=1))
    return float(points[np.hypot(points[:, 0] - x, points[:, 1] - y).argmin(), 2])


def add_rails(parts: Parts, cabin: Shell, x0: float, x1: float, y: float) -> None:
    """Adds roof rails along both sides from x0 (front) to x1."""
    x = np.linspace(x0, x1, 9)
    lift = 0.045 * np.minimum(1, 6 * np.minimum(np.linspace(0, 1, 9), np.linspace(1, 0, 9)))
    z = np.array([_roof_z(cabin.top, float(at), y) for at in x])
    sections = []
    for at, base, up in zip(x, z, lift, strict=True):
        ring = [(-0.015, -0.02), (0.015, -0.02), (0.015, up), (-0.015, up)]
        sections.append([(at, y + dy, base + dz) for dy, dz in ring])
    rings = np.array(sections)
    rail = grid(rings[:, [0, 1, 2, 3, 0]])
    parts.add("trim", flat(rail, DETAILS["plastic"]), both_sides=True)


def add_antenna(parts: Parts, cabin: Shell, x: float) -> None:
    """Adds an aerial in the shape of a fin on the roof."""
    z = _roof_z(cabin.top, x, 0.0) - 0.01
    outline = np.array([[0.09, 0.0], [0.0, 0.02], [-0.09, 0.016], [-0.09, -0.016], [0.0, -0.02]])
    top = np.array([[-0.055, 0.0], [-0.07, 0.006], [-0.095, 0.005], [-0.095, -0.005], [-0.07, -0.006]])
    rings = np.stack([np.column_stack([o, np.full(5, h)]) for o, h in ((outline, 0.0), (top, 0.065))])
    fin = grid(rings[:, [0, 1, 2, 3, 4, 0]]).flipped()
    parts.add("paint", fin.translated(x, 0, z))


def add_roof_sign(parts: Parts, cabin: Shell, x: float, text_cell: str = "taxi") -> None:
    """Adds a taxi sign across the roof."""
    z = _roof_z(cabin.top, x, 0.0)
    block = bevelled_box((0.15, 0.56, 0.15), 0.03, 1, (x, 0, z + 0.075))
    v = block.vertices.copy()
    v[:, 0] = x + (v[:, 0] - x) * (1 - 0.35 * np.clip((v[:, 2] - z) / 0.15, 0, 1))
    yellow = cell_uvs(DETAILS[text_cell], np.array([[0.02, 0.03]]))[0]
    parts.add("trim", Mesh(v, block.faces, block.uvs).with_uvs(yellow))
    for side in (1, -1):
        sign = panel(0.48, 0.10, (0.0, 0.0, 0.0), 0.0 if side > 0 else 180.0, DETAILS[text_cell])
        lean = rotation("y", -side * 10.0)
        parts.add("trim", sign.transformed(lean).translated(x + side * 0.068, 0, z + 0.07))


def add_light_bar(parts: Parts, cabin: Shell, x: float, width: float = 1.1) -> None:
    """Adds a flat bar of blue lamps across the roof."""
    z = _roof_z(cabin.top, x, 0.0)
    foot = bevelled_box((0.2, width * 0.8, 0.05), 0.015, 1, (x, 0, z + 0.015))
    parts.add("trim", flat(foot, DETAILS["plastic"]))
    for share, cell in ((-0.36, "blue"), (0.36, "blue"), (0.0, "clear")):
        span = width * (0.40 if cell == "blue" else 0.30)
        lamp = bevelled_box((0.26, span, 0.09), 0.03, 1, (x, share * width, z + 0.085))
        parts.add("lights", flat(lamp, LAMPS[cell]))


def add_badge(parts: Parts, body: Shell, z: float, front: bool, radius: float = 0.045) -> None:
    """Adds the badge of an invented maker: a silver disc with a dark middle."""
    v = np.linspace(0, 1, 201)
    line = body.side.patch.evaluate(np.column_stack([np.full_like(v, 0.0 if front else 1.0), v]))
    nearest = int(np.abs(line[:, 2] - z).argmin())
    ahead = 1.0 if front else -1.0
    lean = body.side.patch.normals(np.array([[0.0 if front else 1.0, v[nearest]]]))[0]
    tilt = rotation("y", -np.degrees(np.arctan2(lean[2], lean[0] * ahead)))
    ring = revolve([(radius, -0.012), (radius * 0.8, 0.008), (radius * 0.55, 0.004)], 14, "x").transformed(tilt)
    field = revolve([(radius * 0.6, 0.002), (0.0, 0.002)], 14, "x").transformed(tilt)
    at = (float(line[nearest, 0]), 0.0, z)
    parts.add("rim", ring.scaled(ahead, 1, 1).translated(*at))
    parts.add("trim", flat(field, DETAILS["gloss"]).scaled(ahead, 1, 1).translated(*at))


def add_exhaust(parts: Parts, x: float, y: float, z: float, radius: float = 0.035, both: bool = False) -> None:
    """Adds an exhaust pipe that points backwards."""
    profile = [(radius, -0.14), (radius, 0.0), (radius * 0.85, 0.0), (radius * 0.85, -0.10)]
    pipe = revolve(profile, 12, "x").scaled(-1, 1, 1)
    parts.add("rim", pipe.translated(x, y, z), both_sides=both)
    hollow = revolve([(radius * 0.86, 0.0), (0.0, 0.0)], 12, "x").scaled(-1, 1, 1)
    parts.add("trim", flat(hollow, DETAILS["gloss"]).translated(x + 0.015, y, z), both_sides=both)
