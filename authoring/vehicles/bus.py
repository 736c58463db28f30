"""The equipment of a bus: doors, mirrors on arms, displays, marker lamps, and an inside behind its panes."""

from __future__ import annotations

import numpy as np

from authoring.mesh import Mesh, bevelled_box, box, merge
from authoring.tubes import tube
from authoring.vehicles.atlas import DETAILS, LAMPS, flat
from authoring.vehicles.bus_inside import BAYS, DOORS, DRIVER, REAR, SCREEN
from authoring.vehicles.car import CarSpec
from authoring.vehicles.fittings import panel
from authoring.vehicles.panes import Pane, pieces
from authoring.vehicles.parts import Parts
from authoring.vehicles.shell import Shell

__all__ = ["fit_bus"]

_KERB_Y = -1.274
_DOORS = ((4.72, 1.25), (0.35, 1.35), (-4.55, 1.2))
"""Positions x and widths of the doors on the right side, metres."""

_BAYS_LEFT, _BAYS_RIGHT = (0, 3, 1, 2, 0, 1, 2), (2, 1, 0, 3, 1, 0, 3)
"""Number of the picture in each bay of windows, from front to rear."""


def fit_bus(spec: CarSpec, parts: Parts, body: Shell, cabin: Shell) -> None:
    """Adds the equipment of a bus, and puts pictures of its inside on its panes."""
    front_x, rear_x = cabin.side.patch.evaluate(np.array([[u, 0.3] for u in cabin.corners]))[:, 0]
    parts.meshes["glass"] = [_seen_through(mesh, spec, front_x, rear_x) for mesh in parts.meshes["glass"]]
    for x, width in _DOORS:
        _add_door(parts, x, width)
    _add_mirrors(parts)
    parts.add("trim", panel(1.9, 0.26, (5.905, 0, 2.62), 0.0, DETAILS["display"]))
    parts.add("trim", flat(box((0.04, 1.2, 0.22), (-5.955, 0, 2.64)), DETAILS["gloss"]))
    parts.add("trim", panel(1.1, 0.15, (-5.977, 0, 2.64), 180.0, DETAILS["display"]))
    parts.add("trim", flat(box((1.3, 0.03, 0.24), (3.1, _KERB_Y + 0.02, 2.63)), DETAILS["gloss"]))
    parts.add("trim", panel(1.2, 0.17, (3.1, _KERB_Y, 2.63), -90.0, DETAILS["display"]))
    parts.add("trim", panel(10.0, 0.08, (0, 1.2745, 1.04), 90.0, DETAILS["white"]), both_sides=True)
    for x in (5.0, 2.3, 0.5, -1.3, -3.7, -5.2):
        parts.add("lights", flat(box((0.10, 0.012, 0.04), (x, 1.279, 0.60)), LAMPS["amber"]), both_sides=True)
    for y, cell in ((0.98, "amber"), (0.80, "red")):
        parts.add("lights", flat(box((0.05, 0.15, 0.07), (-5.945, y, 2.64)), LAMPS[cell]), both_sides=True)
    parts.add("paint", _rounded(box((2.6, 1.7, 0.22), (-2.2, 0, 3.12))))
    for x in (3.4, 1.0):
        parts.add("paint", _rounded(box((0.75, 0.75, 0.07), (x, 0, 3.05))))


def _add_door(parts: Parts, x: float, width: float) -> None:
    parts.add("trim", flat(box((width + 0.08, 0.04, 2.16), (x, _KERB_Y, 1.44)), DETAILS["gloss"]))
    leaf, high = width / 2 - 0.07, 1.96
    for side, pane in zip((-1, 1), DOORS, strict=True):
        at = (x + side * width / 4, _KERB_Y - 0.018, 1.44)
        glass = box((leaf, 0.012, high), at)
        along, up = (glass.vertices[:, 0] - at[0]) / leaf + 0.5, (glass.vertices[:, 2] - at[2]) / high + 0.5
        parts.add("glass", pane.dress(glass, along, up))
        bar = box((0.03, 0.03, 0.5), (x + side * 0.09, _KERB_Y - 0.03, 1.35))
        parts.add("trim", flat(bar, DETAILS["silver"]))


def _add_mirrors(parts: Parts) -> None:
    """Adds mirrors that hang in front of the corners, on arms from the edge of the roof."""
    arm = tube([(5.72, 1.04, 2.96), (5.98, 1.22, 2.97), (6.12, 1.38, 2.88), (6.13, 1.41, 2.66)], 0.025, 6)
    parts.add("trim", flat(arm, DETAILS["plastic"]), both_sides=True)
    at = (6.13, 1.41, 2.38)
    housing = bevelled_box((0.12, 0.24, 0.56), 0.045, 1, at)
    parts.add("trim", flat(housing, DETAILS["plastic"]), both_sides=True)
    glass = panel(0.17, 0.46, (at[0] - 0.063, at[1], at[2]), 180, DETAILS["silver"])
    parts.add("rim", glass, both_sides=True)


def _seen_through(mesh: Mesh, spec: CarSpec, front_x: float, rear_x: float) -> Mesh:
    """Returns the glass of one side with a picture on each pane."""
    middle = mesh.vertices[mesh.faces].mean(axis=1)
    left = float(middle[:, 1].mean()) > 0
    posts = sorted((x for x, _ in spec.glass_posts), reverse=True)
    edges = [front_x, *posts, rear_x]
    which = np.searchsorted(-np.array(edges), -middle[:, 0])
    order = _BAYS_LEFT if left else _BAYS_RIGHT
    dressed = []
    for k, piece in pieces(mesh, which):
        low, high = piece.bounds
        x, y, z = piece.vertices.T
        pane: Pane
        if k in (0, len(edges)):
            half = float(np.abs(y).max())
            pane, along = (SCREEN, y / half / 2 + 0.5) if k == 0 else (REAR, 0.5 - y / half / 2)
        else:
            pane = DRIVER if k == 1 else BAYS[order[k - 2]]
            along = (x - low[0]) / (high[0] - low[0])
            along = 1 - along if left else along
        dressed.append(pane.dress(piece, along, (z - low[2]) / (high[2] - low[2])))
    return merge(dressed)


def _rounded(mesh: Mesh) -> Mesh:
    """Returns a box whose upper face is smaller than its lower face."""
    low, high = mesh.bounds
    v = mesh.vertices.copy()
    top = v[:, 2] > (low[2] + high[2]) / 2
    centre = (low + high) / 2
    v[top, :2] = centre[:2] + (v[top, :2] - centre[:2]) * 0.93
    return Mesh(v, mesh.faces, mesh.uvs)
