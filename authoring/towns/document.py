"""The MJCF text of a town: assets, default classes, geoms, collision and the `<custom>` section."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from authoring.materials import MATERIALS, material_xml
from authoring.towns.collision import Solid
from authoring.towns.lanes import Lane
from authoring.towns.regions import BayGroup
from authoring.towns.walks import Walk

# The one material without a texture: a dark, smooth, rippleless canal.
WATER_XML = '<material name="water" rgba="0.035 0.06 0.055 1" metallic="0" roughness="0.08" specular="0.6"/>'
# Below all visible ground: T-junctions of meshes leave cracks of a pixel, which would show the sky.
UNDERGROUND_TOP_M = -2.2
UNDERGROUND_MATERIAL_XML = '<material name="underground" rgba="0.03 0.03 0.03 1" metallic="0" roughness="1"/>'
UNDERGROUND_XML = (
    '<geom name="underground" class="ground" type="box" size="1000 1000 0.1" '
    f'pos="0 0 {UNDERGROUND_TOP_M - 0.1:g}" material="underground"/>'
)
HEAD = """\
<!-- Written by `python -m authoring.towns {name}`. Conventions: docs/mjcf-conventions.md. -->
<mujoco model="{name}">
  <compiler angle="degree" balanceinertia="true" meshdir="{name}" texturedir="../textures"/>
  <statistic extent="400" center="0 0 10"/>
  <visual>
    <global offwidth="2048" offheight="1024"/>
    <quality shadowsize="8192"/>
    <map znear="0.00025" zfar="4" shadowclip="0.8"/>
    <headlight ambient="0.25 0.27 0.3" diffuse="0 0 0" specular="0 0 0"/>
  </visual>
"""
LIGHTS = """\
    <light name="sun" type="directional" pos="-150 -150 212" dir="0.5 0.5 -0.707" diffuse="1 0.96 0.88"
      ambient="0.22 0.25 0.3" specular="0.3 0.3 0.3" castshadow="true"/>
"""
SKY = (
    '<texture name="sky" type="skybox" builtin="gradient" rgb1="0.36 0.55 0.82" rgb2="0.78 0.84 0.9" '
    'width="256" height="1536"/>'
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Geom:
    """A visible mesh geom: which mesh, material and default class, and where."""

    mesh: str
    material: str
    label: str
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw_deg: float = 0.0
    scale: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A countable object: a body of its own."""

    name: str
    geoms: Sequence[Geom]
    position: tuple[float, float, float]
    yaw_deg: float


@dataclass(slots=True)
class Document:
    """The content of a town's file."""

    name: str
    bounds: tuple[float, float, float, float]
    meshes: list[str] = field(default_factory=list)
    geoms: list[Geom] = field(default_factory=list)
    bodies: list[Body] = field(default_factory=list)
    solids: list[Solid] = field(default_factory=list)
    lanes: list[Lane] = field(default_factory=list)
    sidewalks: list[Walk] = field(default_factory=list)
    crosswalks: list[Walk] = field(default_factory=list)
    bays: list[tuple[str, float, float, npt.NDArray[np.float64]]] = field(default_factory=list)

    def text(self) -> str:
        """The file's text."""
        geoms = [*self.geoms, *[geom for body in self.bodies for geom in body.geoms]]
        used = sorted({geom.material for geom in geoms})
        labels = sorted({"ground", *(geom.label for geom in geoms)})
        lines = [HEAD.format(name=self.name), "  <default>", '    <mesh inertia="shell"/>']
        lines.append('    <default class="collision"><geom group="3" rgba="0.8 0.3 0.3 0.4"/></default>')
        lines.append('    <default class="visible">')
        lines.append('      <geom type="mesh" contype="0" conaffinity="0" group="1"/>')
        lines += [f'      <default class="{label}"><geom group="1"/></default>' for label in labels]
        lines += ["    </default>", "  </default>", "  <asset>", f"    {SKY}"]
        lines += ["    " + line for line in material_xml([m for m in used if m in MATERIALS]).splitlines()]
        lines += [f"    {WATER_XML}"] if "water" in used else []
        lines.append(f"    {UNDERGROUND_MATERIAL_XML}")
        lines += [f'    <mesh name="{mesh}" file="{mesh}.obj"/>' for mesh in self.meshes]
        lines += ["  </asset>", "  <worldbody>", LIGHTS.rstrip("\n"), f"    {UNDERGROUND_XML}"]
        lines += ["    " + _geom(geom) for geom in self.geoms]
        for body in self.bodies:
            lines.append(f'    <body name="{body.name}" pos="{_row(body.position)}" euler="0 0 {body.yaw_deg:g}">')
            lines += ["      " + _geom(geom) for geom in body.geoms]
            lines.append("    </body>")
        lines += ["    " + _solid(solid) for solid in self.solids]
        lines += ["  </worldbody>", "  <custom>", f'    <numeric name="town.bounds" data="{_row(self.bounds)}"/>']
        for lane in self.lanes:
            lines += _lane(lane)
        for kind, walks in (("sidewalk", self.sidewalks), ("crosswalk", self.crosswalks)):
            lines += [_numeric(f"{kind}.{walk.name}", [walk.width_m], walk.points) for walk in walks]
        lines += [_numeric(f"parking.{name}", [long, wide], bays) for name, long, wide, bays in self.bays]
        lines += ["  </custom>", "</mujoco>", ""]
        return "\n".join(lines)


def bay_rows(groups: Iterable[BayGroup]) -> list[tuple[str, float, float, npt.NDArray[np.float64]]]:
    """Parking bays by street and side, as `parking.…` wants them."""
    rows: dict[str, list[tuple[float, float, float, float]]] = {}
    for group in groups:
        name = f"{group.street}_{'left' if group.side > 0 else 'right'}"
        rows.setdefault(name, []).extend((x, y, 0.0, yaw) for x, y, yaw in group.bays)
    return [(name, 5.8, 2.3, np.asarray(bays)) for name, bays in rows.items()]


def _geom(geom: Geom) -> str:
    place = f' pos="{_row(geom.position)}"' if any(geom.position) else ""
    turn = f' euler="0 0 {geom.yaw_deg:g}"' if geom.yaw_deg else ""
    return f'<geom class="{geom.label}" mesh="{geom.mesh}" material="{geom.material}"{place}{turn}/>'


def _solid(solid: Solid) -> str:
    turn = "" if solid.quaternion == (1.0, 0.0, 0.0, 0.0) else f' quat="{_row(solid.quaternion, 6)}"'
    return (
        f'<geom class="collision" name="{solid.name}" type="{solid.kind}" pos="{_row(solid.centre)}" '
        f'size="{_row(solid.size)}"{turn}/>'
    )


def _lane(lane: Lane) -> list[str]:
    following = ",".join(f"lane.{name}" for name in lane.following)
    left, right = (f"lane.{name}" if name else "" for name in (lane.left, lane.right))
    kind = " kind=junction" if lane.junction else ""
    return [
        _numeric(f"lane.{lane.name}", [lane.width_m, lane.speed_mps], lane.points),
        f'    <text name="lane.{lane.name}" data="next={following} left={left} right={right}{kind}"/>',
    ]


def _numeric(name: str, head: Sequence[float], points: npt.NDArray[np.float64]) -> str:
    rows = "  ".join(_row(row) for row in points.tolist())
    return f'    <numeric name="{name}" data="{_row(head)}  {rows}"/>'


def _row(values: Iterable[float], digits: int = 3) -> str:
    return " ".join(
        f"{round(float(value), digits) + 0.0:g}" if abs(value) < 1e3 else f"{value:.2f}" for value in values
    )
