"""Two-wheelers as MJCF."""

from __future__ import annotations

from pathlib import Path

from authoring.mesh import write_obj
from authoring.people.key_points import key_point_lines
from authoring.people.texture import write_atlas, write_skin
from authoring.two_wheelers.machine import COLOURS, TwoWheeler, model_machine
from authoring.two_wheelers.plate import add_picture

_XML = """<mujoco model="{name}">
  <!-- Made by `python -m authoring.two_wheelers`; the rider is part of the file. -->
  <compiler angle="degree" meshdir="{name}" texturedir="{name}"/>
  <custom>
    <text name="actor.kind" data="{kind}"/>
    <numeric name="paint.palette" data="{palette}"/>{key_points}
  </custom>
  <default>
    <default class="seen">
      <mesh inertia="shell"/>
      <geom type="mesh" group="1" contype="0" conaffinity="0" mass="0"/>
{classes}
    </default>
    <default class="collision">
      <geom type="box" group="3"/>
    </default>
  </default>
  <asset>
    <texture name="machine" type="2d" file="machine.png" colorspace="sRGB"/>
    <texture name="cloth" type="2d" file="cloth.png" colorspace="sRGB"/>
    <texture name="skin" type="2d" file="skin.png" colorspace="sRGB"/>
    <material name="paint" texture="machine" metallic="0.1" roughness="0.25"/>
    <material name="metal" texture="machine" metallic="0.7" roughness="0.38"/>
    <material name="trim" texture="machine" metallic="0" roughness="0.6"/>
    <material name="cloth" texture="cloth" metallic="0" roughness="0.8"/>
    <material name="skin" texture="skin" metallic="0" roughness="0.6"/>
{meshes}
  </asset>
  <worldbody>
    <body name="{name}">
{geoms}
      <geom name="machine" class="collision" size="{length:.3f} 0.25 0.45" pos="0 0 0.45"/>
      <geom name="rider" class="collision" size="0.4 0.3 {rider_half:.3f}" pos="{rider_x:.3f} 0 {rider_z:.3f}"/>
    </body>
  </worldbody>
</mujoco>
"""
_MATERIALS = {"rider_jacket": "cloth", "rider_cloth": "cloth", "rider_skin": "skin", "rider_hair": "cloth"}
_RIDER_BOTTOM_M = 0.9


def _geom_class(machine: TwoWheeler, group: str) -> str:
    if group == "rider_jacket":
        return "rider.paint" if machine.painted == "rider" else "rider.jacket"
    if group.startswith("rider_"):
        return group.replace("_", ".")
    if group == "paint" and machine.painted == "rider":
        return f"{machine.kind}.frame"
    return f"{machine.kind}.{group}"


def write_two_wheeler(out: Path, machine: TwoWheeler) -> None:
    """Write the machine's folder of meshes and textures and its MJCF into `out`."""
    folder = out / machine.name
    folder.mkdir(parents=True, exist_ok=True)
    figure = model_machine(machine)
    meshes = figure.meshes
    for group, mesh in meshes.items():
        write_obj(folder / f"{group}.obj", mesh)
    write_atlas(folder / "machine.png", COLOURS)
    if machine.hard.plate is not None:
        add_picture(folder / "machine.png", machine.hard.plate)
    write_atlas(folder / "cloth.png", machine.rider.atlas)
    write_skin(folder / "skin.png", machine.rider.face)
    first = machine.palette[0][:3]
    tinted = {
        "paint": first if machine.painted == "machine" else machine.colour,
        "rider_jacket": first if machine.painted == "rider" else machine.colour,
    }
    geoms = []
    for group in meshes:
        colour = f' rgba="{" ".join(f"{value:g}" for value in tinted[group])} 1"' if group in tinted else ""
        geoms.append(
            f'      <geom name="{group}" class="{_geom_class(machine, group)}" mesh="{group}"'
            f' material="{_MATERIALS.get(group, group)}"{colour}/>'
        )
    length = max(-meshes["trim"].bounds[0, 0], meshes["trim"].bounds[1, 0])
    top = max(mesh.bounds[1, 2] for mesh in meshes.values())
    jacket = meshes["rider_jacket"].bounds
    xml = _XML.format(
        name=machine.name,
        kind=machine.kind,
        palette="  ".join(" ".join(f"{value:g}" for value in row) for row in machine.palette),
        key_points=key_point_lines(figure.key_points),
        classes="\n".join(f'      <default class="{_geom_class(machine, group)}"/>' for group in meshes),
        meshes="\n".join(f'    <mesh class="seen" file="{group}.obj"/>' for group in meshes),
        geoms="\n".join(geoms),
        length=length,
        rider_half=(top - _RIDER_BOTTOM_M) / 2,
        rider_x=(jacket[0, 0] + jacket[1, 0]) / 2,
        rider_z=(top + _RIDER_BOTTOM_M) / 2,
    )
    (out / f"{machine.name}.xml").write_text(xml, encoding="utf-8")
