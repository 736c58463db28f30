"""Finds the lamps and the lit windows of a compiled town, by the materials of their glass."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from gear.camera.glow import LitWindows
from gear.camera.lamps import Lamps, globe_beam, street_beam
from gear.values.geometry import Array
from gear.world.assets.geom_triangles import static_geoms, world_triangles

PALETTE, LAMP_GLASS = "palette", (0.5, 0.5, 0.625, 0.625)
"""Name of the material of gear's street furniture, and the part of its texture that is the glass of lamps:
smallest u and v, largest u and v, with v from the top.
"""

LAMP_MATERIAL = "lamp_glass"
"""Name of a material that is entirely the glass of lamps."""

STREET_INTENSITY, GLOBE_INTENSITY = 24.0, 2.2
STREET_COLOUR, GLOBE_COLOUR = (1.0, 0.80, 0.55), (1.0, 0.70, 0.38)
STREET_REACH_M, GLOBE_REACH_M = 32.0, 18.0
ONE_LAMP_M = 0.9
"""Distance in metres below which two triangles of glass belong to the same lamp."""

DOWNWARD = 0.7
"""If the mean normal of a lamp's glass is longer than this, the lamp shines in one direction, as street lamps do."""

STANDARD_AREA_M2 = 0.15
"""Area of glass of a street lamp with the usual intensity, m². The intensity of a street lamp is proportional to this
area, up to twice the usual intensity.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Glazing:
    """The window panes in the texture of a material, and their appearance when they are lit.

    Attributes:
        columns: number of panes per unit of the texture coordinate u; None for one pane per quad.
        u, v: smallest and largest texture coordinates of the glass within a pane's cell, with v from the top.
        lit: share of the panes that are lit at night.
        gain: factor on the frame's own light on a lit pane.
        light: light that a lit pane adds, as a share of full scale.
    """

    columns: int | None = None
    u: tuple[float, float] = (0.0, 1.0)
    v: tuple[float, float] = (0.0, 1.0)
    lit: float
    gain: float
    light: float


GLAZINGS = {
    "windows": Glazing(lit=0.28, gain=1.0, light=0.12),
    "shop_fronts": Glazing(lit=0.8, gain=1.3, light=0.10),
    "curtain_wall": Glazing(columns=8, u=(0.02, 0.98), v=(0.0, 0.76), lit=0.16, gain=2.2, light=0.045),
    **{
        name: Glazing(columns=8, u=(0.32, 0.68), v=(0.3, 0.7), lit=0.25, gain=1.0, light=0.12)
        for name in ("far_facades", "far_facades_warm", "far_facades_dark")
    },
}
"""The window panes in textures, by the name of the material."""

WARM, COOL = np.array([1.0, 0.78, 0.50]), np.array([0.80, 0.92, 1.0])


def _standing(model: mujoco.MjModel, names: Collection[str]) -> Iterator[tuple[str, int]]:
    """Yields (material's name, geom id) for the geoms of the town whose material has one of the names."""
    for geom in np.flatnonzero(static_geoms(model) & (model.geom_matid >= 0)).tolist():
        name = model.mat(int(model.geom_matid[geom])).name
        if name in names:
            yield name, geom


def _texture_places(model: mujoco.MjModel, geom: int) -> Array | None:
    """(N, 3, 2) texture coordinates of a mesh's triangles, v from the top; None for a geom without them."""
    mesh = int(model.geom_dataid[geom])
    if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_MESH or model.mesh_texcoordadr[mesh] < 0:
        return None
    first, count = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    places = model.mesh_facetexcoord[first : first + count] + model.mesh_texcoordadr[mesh]
    return np.asarray(model.mesh_texcoord[places], dtype=np.float64)


def find_lamps(model: mujoco.MjModel, data: mujoco.MjData) -> dict[str, Lamps]:
    """Finds the street lamps of a town.

    Args:
        model: compiled model; its meshes must not have been released.
        data: MuJoCo data of the model with kinematics up to date.

    Returns:
        The lamps by kind: `street` shines down, `globe` in all directions.

    Raises:
        ValueError: a geom of lamp glass has no finite surface.
    """
    glass = []
    for name, geom in _standing(model, (PALETTE, LAMP_MATERIAL)):
        places = _texture_places(model, geom)
        if name == LAMP_MATERIAL:
            glass.append(world_triangles(model, data, geom))
        elif places is not None:
            u, v = np.moveaxis(places.mean(axis=1), 1, 0)
            u0, v0, u1, v1 = LAMP_GLASS
            glass.append(world_triangles(model, data, geom)[(u > u0) & (u < u1) & (v > v0) & (v < v1)])
    corners = np.concatenate(glass) if glass else np.zeros((0, 3, 3))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    area, middle = np.linalg.norm(normal, axis=1), corners.mean(axis=1)
    street: list[tuple[Array, Array, float]] = []
    globe: list[tuple[Array, Array, float]] = []
    left = np.ones(len(corners), bool)
    for index in range(len(corners)):
        if not left[index]:
            continue
        one = left & (np.linalg.norm(middle - middle[index], axis=1) < ONE_LAMP_M)
        left &= ~one
        weight = area[one] / area[one].sum()
        axis = normal[one].sum(axis=0) / area[one].sum()
        place = weight @ middle[one]
        if np.linalg.norm(axis) > DOWNWARD:
            street.append((place, axis / np.linalg.norm(axis), min(area[one].sum() / STANDARD_AREA_M2, 2.0)))
        else:
            globe.append((place, np.array([0.0, 0.0, -1.0]), 1.0))
    return {
        "street": Lamps(
            **_placed(street, STREET_INTENSITY),
            colour=STREET_COLOUR,
            beam=street_beam,
            reach_m=STREET_REACH_M,
            up_m=0.1,
            down_m=17.0,
        ),
        "globe": Lamps(
            **_placed(globe, GLOBE_INTENSITY),
            colour=GLOBE_COLOUR,
            beam=globe_beam,
            reach_m=GLOBE_REACH_M,
            up_m=9.0,
            down_m=6.0,
        ),
    }


def _placed(found: Sequence[tuple[Array, Array, float]], intensity: float) -> dict[str, Any]:
    return {
        "position_m": np.array([place for place, _, _ in found]).reshape(-1, 3),
        "axis": np.array([axis for _, axis, _ in found]).reshape(-1, 3),
        "intensity": np.array([intensity * share for _, _, share in found]),
    }


def find_windows(model: mujoco.MjModel, data: mujoco.MjData, rng: np.random.Generator) -> LitWindows:
    """Finds the windows of a town and draws at random which of them are lit.

    Args:
        model: compiled model; its meshes must not have been released.
        data: MuJoCo data of the model with kinematics up to date.
        rng: random generator for the lit panes, their brightness and their colour.

    Returns:
        The lit panes, with their brightness and colour, in the form that the camera pipeline draws.
    """
    panes: list[Array] = []
    geoms: list[npt.NDArray[np.int32]] = []
    shown: list[Array] = []
    for name, geom in _standing(model, GLAZINGS):
        places = _texture_places(model, geom)
        if places is None:
            continue
        glazing = GLAZINGS[name]
        quads = _panes(*_quads(world_triangles(model, data, geom), places), glazing)
        quads = quads[rng.random(len(quads)) < glazing.lit]
        count = len(quads)
        coolness = rng.uniform(0, 1 if name == "curtain_wall" else 0.35, (count, 1))
        colour = rng.uniform(0.25, 1.0, (count, 1)) * (WARM + coolness * (COOL - WARM))
        panes.append(quads)
        geoms.append(np.full(count, geom, np.int32))
        shown.append(np.stack([glazing.gain * colour, glazing.light * colour], axis=1))
    shape = np.concatenate([np.zeros((0, 4, 3)), *panes])
    gain, light = np.concatenate([np.zeros((0, 2, 3)), *shown]).astype(np.float32).transpose(1, 0, 2)
    normal = np.cross(shape[:, 1] - shape[:, 0], shape[:, 2] - shape[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    return LitWindows(
        corners_m=shape,
        normal=normal,
        geom_id=np.concatenate([np.zeros(0, np.int32), *geoms]),
        gain=gain,
        light=light,
    )


def _quads(corners: Array, uv: Array) -> tuple[Array, Array]:
    """Joins pairs of consecutive triangles that form a quad (a, b, c, d).

    A quad may be cut along either diagonal: into (a, b, c) and (a, c, d), or into (a, b, d) and (b, c, d).

    Args:
        corners: (T, 3, 3) corners of the triangles.
        uv: (T, 3, 2) texture coordinates of the corners.

    Returns:
        (N, 4, 3) corners and (N, 4, 2) texture coordinates of the quads.
    """

    def meet(corner: int, others: int) -> npt.NDArray[np.bool_]:
        return np.asarray(np.isclose(corners[:-1, corner], corners[1:, others]).all(axis=1))

    is_fan = meet(0, 0) & meet(2, 1)
    fits = is_fan | (meet(1, 0) & meet(2, 2))
    # No triangle may belong to two quads, so of consecutive pairs only every other one is used.
    places = np.arange(len(fits))
    fits &= (places - np.maximum.accumulate(np.where(fits, -1, places))) % 2 == 1

    def joined(table: Array) -> Array:
        one, other = table[:-1], table[1:]
        fan = np.concatenate([one, other[:, 2:]], axis=1)
        cut = np.stack([one[:, 0], one[:, 1], other[:, 1], one[:, 2]], axis=1)
        return np.asarray(np.where(is_fan[:, None, None], fan, cut)[fits])

    return joined(corners), joined(uv)


def _panes(quads: Array, uv: Array, glazing: Glazing) -> Array:
    """(M, 4, 3) corners of the panes in (N, 4, 3) quads with (N, 4, 2) texture coordinates."""
    # Two sides of a quad meet in its first corner; u runs along one of them.
    second, last = uv[:, 1] - uv[:, 0], uv[:, 3] - uv[:, 0]
    is_first = np.abs(second[:, 0]) > np.abs(last[:, 0])
    u_grows = np.where(is_first, second[:, 0], last[:, 0]) > 0
    v_grows = np.where(is_first, last[:, 1], second[:, 1]) > 0
    width = np.where(is_first, np.abs(second[:, 0]), np.abs(last[:, 0]))
    counts = (
        np.maximum(np.round(width * glazing.columns), 1).astype(int) if glazing.columns else np.ones(len(quads), int)
    )
    owner = np.repeat(np.arange(len(quads)), counts)
    column = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    u = [(column + side) / counts[owner] for side in glazing.u]
    u = [np.where(u_grows[owner], value, 1 - value) for value in u]
    v = [np.where(v_grows[owner], value, 1 - value) for value in glazing.v]
    corners = []
    for number in range(4):
        across, along = u[number in (1, 2)], v[number in (2, 3)]
        s, t = (np.where(is_first[owner], one, other)[:, None] for one, other in ((across, along), (along, across)))
        quad = quads[owner]
        low = quad[:, 0] + s * (quad[:, 1] - quad[:, 0])
        corners.append(low + t * (quad[:, 3] + s * (quad[:, 2] - quad[:, 3]) - low))
    panes = np.stack(corners, axis=1)
    # The corners of a pane have the order of its quad, so that both face the same way.
    turned = (is_first ^ u_grows ^ v_grows)[owner]
    return np.where(turned[:, None, None], panes, panes[:, ::-1])
