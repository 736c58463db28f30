"""A half shell: belt and cap over one plan, with the lines that describe it in side view."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from authoring.mesh import Floats, Mesh, grid
from authoring.vehicles.patches import Deform, Patch, belt, cap
from authoring.vehicles.sheet import Sheet, lattice

__all__ = ["Level", "Shell", "make_shell", "surface_point"]

Line = Callable[[Floats], Floats]


@dataclass(frozen=True)
class Level:
    """One level of a shell's control net.

    Attributes:
        height: 0 at the foot line, 1 at the rim line.
        side, front, rear: how far the plan is drawn in here, metres; `front` and `rear` move along x.
    """

    height: float
    side: float
    front: float
    rear: float


@dataclass
class Shell:
    """Sheets of a left half shell.

    Attributes:
        side: the belt's sheet, foot to rim, front middle to rear middle.
        top: the cap's sheet.
        arc_m: length of the plan's half outline.
        corners: belt parameters of the front and rear corners.
    """

    side: Sheet
    top: Sheet
    arc_m: float
    corners: tuple[float, float]
    _table: tuple[Floats, Floats]
    _lines: Floats

    def along(self, u: Floats) -> Floats:
        """Distance round the outline from the front's middle, metres, of belt parameters."""
        return np.interp(u, *self._table)

    def foot(self) -> Mesh:
        """A plate across the belt's lower rim (left half), facing down."""
        u = self._lines
        rim = self.side.patch.evaluate(np.column_stack([u, np.zeros_like(u)]))
        axis = rim * [1, 0, 1]
        return grid(np.stack([axis, rim], axis=1))


def make_shell(
    plan: ArrayLike,
    levels: Sequence[Level],
    foot: Line,
    rim: Line,
    crown: Line,
    *,
    deform: Deform | None = None,
    shift_reach: tuple[float, float] = (0.9, 0.9),
    cells: tuple[int, int, int] = (20, 9, 4),
    extra_u: Sequence[float] = (),
    corner_deg: float = 45.0,
) -> Shell:
    """Builds a shell.

    Args:
        plan: (C, 2) control polygon of the widest outline, front middle to rear middle, y >= 0.
        levels: rows of the control net, foot to rim.
        foot: z of the lower rim by x.
        rim: z of the upper rim by x.
        crown: z of the cap's centre line by x.
        deform: moves the belt's points (wheel arch flares).
        shift_reach: how far behind the front and ahead of the rear the levels' x shifts fade out, metres.
        cells: lattice cells along the belt, up the belt, across the half cap.
        extra_u: more lattice lines at these x positions (metres), for shapes that need them.
        corner_deg: where in the plan's turn the cap's corners are.
    """
    outline = np.asarray(plan, dtype=np.float64)
    front_x, rear_x = outline[0, 0], outline[-1, 0]
    widest = outline[:, 1].max()
    fore = _fade((outline[:, 0] - (front_x - shift_reach[0])) / shift_reach[0])
    aft = _fade(((rear_x + shift_reach[1]) - outline[:, 0]) / shift_reach[1])
    net = np.empty((len(outline), len(levels), 3))
    for k, level in enumerate(levels):
        net[:, k, 0] = outline[:, 0] - fore * level.front + aft * level.rear
        net[:, k, 1] = outline[:, 1] * (1 - level.side / widest)
        low = foot(outline[:, 0])
        net[:, k, 2] = low + level.height * (rim(net[:, k, 0]) - low)
    patch = belt(net, deform)
    u = np.linspace(0, 1, 601)
    ring = patch.evaluate(np.column_stack([u, np.full_like(u, 0.45)]))[:, :2]
    steps = np.diff(ring, axis=0)
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(steps, axis=1))])
    turn = np.degrees(np.arctan2(-steps[:, 0], steps[:, 1]))
    corner_front = u[np.searchsorted(turn, corner_deg)]
    corner_rear = u[np.searchsorted(turn, 180 - corner_deg)]
    # The cap's columns continue the belt's, so that the two meet without a gap.
    share = np.linspace(0, 1, cells[2] + 1) ** 0.8
    middle = (u >= corner_front) & (u <= corner_rear)
    weight = np.gradient(arc) + 0.35 * np.abs(np.gradient(np.radians(np.append(turn, turn[-1]))))
    grown = np.cumsum(weight[middle])
    inner = np.interp(np.linspace(grown[0], grown[-1], cells[0] + 1), grown, u[middle])
    if extra_u:
        inner = np.unique(np.concatenate([inner, np.interp(-np.asarray(extra_u), -ring[:, 0], u)]))
    inner[0], inner[-1] = corner_front, corner_rear
    lines = np.concatenate([corner_front * share[:-1], inner, 1 - (1 - corner_rear) * share[:-1][::-1]])
    up = _up_lines(patch, cells[1])
    side = lattice(patch, lines, up, "paint")
    top_patch = cap(patch, corner_front, corner_rear, crown)
    top = lattice(top_patch, (inner - corner_front) / (corner_rear - corner_front), np.sort(1 - share), "paint")
    return Shell(side, top, float(arc[-1]), (float(corner_front), float(corner_rear)), (u, arc), lines)


def _up_lines(patch: Patch, count: int) -> Floats:
    v = np.linspace(0, 1, 301)
    bend = np.zeros(300)
    for at in (0.02, 0.25, 0.5, 0.75):
        rise = np.diff(patch.evaluate(np.column_stack([np.full_like(v, at), v])), axis=0)
        unit = rise / np.linalg.norm(rise, axis=1, keepdims=True)
        angle = np.arccos(np.clip((unit[1:] * unit[:-1]).sum(axis=1), -1, 1))
        bend += np.linalg.norm(rise, axis=1) + 0.25 * np.concatenate([angle, angle[-1:]])
    grown = np.concatenate([[0.0], np.cumsum(bend)])
    return np.asarray(np.interp(np.linspace(0, grown[-1], count + 1), grown, v), dtype=np.float64)


def _fade(t: Floats) -> Floats:
    t = np.clip(t, 0, 1)
    return np.asarray(t * t * (3 - 2 * t), dtype=np.float64)


def surface_point(sheet: Sheet, x: float, z: float) -> tuple[Floats, Floats]:
    """The outermost point of a left half sheet at (x, z), and its normal, each (3,)."""
    u, v = np.meshgrid(np.linspace(0, 1, 241), np.linspace(0, 1, 81), indexing="ij")
    params = np.stack([u.reshape(-1), v.reshape(-1)], axis=1)
    points = sheet.patch.evaluate(params)
    best = np.hypot(points[:, 0] - x, points[:, 2] - z).argsort()[:6]
    chosen = best[points[best, 1].argmax()]
    point = points[chosen].copy()
    point[[0, 2]] = x, z
    return point, sheet.patch.normals(params[chosen : chosen + 1])[0]
