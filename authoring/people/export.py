"""Writes people as MJCF: one file per pose, with meshes and textures in the folder of the person."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from authoring.mesh import write_obj
from authoring.people.figure import GROUPS, Person, model_person
from authoring.people.key_points import KeyPoints, key_point_lines
from authoring.people.skeleton import Pose
from authoring.people.texture import write_atlas, write_skin

_XML = """<mujoco model="{name}_{pose}">
  <!-- Made by `python -m authoring.people`. -->
  <compiler angle="degree" meshdir="{name}" texturedir="{name}"/>
  <custom>
    <text name="actor.kind" data="person"/>
    <text name="actor.person" data="{name}"/>
    <text name="actor.pose" data="{kind}"/>
    <numeric name="paint.palette" data="{palette}"/>{key_points}
  </custom>
  <default>
    <default class="seen">
      <mesh inertia="shell"/>
      <geom type="mesh" group="1" contype="0" conaffinity="0" mass="0"/>
{classes}
    </default>
    <default class="collision">
      <geom type="capsule" group="3"/>
    </default>
  </default>
  <asset>
    <texture name="cloth" type="2d" file="cloth.png" colorspace="sRGB"/>
    <texture name="skin" type="2d" file="skin.png" colorspace="sRGB"/>
    <material name="cloth" texture="cloth" metallic="0" roughness="0.9"/>
    <material name="leather" texture="cloth" metallic="0" roughness="0.55"/>
    <material name="hair" texture="cloth" metallic="0" roughness="0.6"/>
    <material name="skin" texture="skin" metallic="0" roughness="0.6"/>
{meshes}
  </asset>
  <worldbody>
    <body name="{name}">
{geoms}
      <geom name="capsule" class="collision" fromto="0 0 {radius:.3f} 0 0 {top:.3f}" size="{radius:.3f}"/>
    </body>
  </worldbody>
</mujoco>
"""
_MATERIALS = {"paint": "cloth", "cloth": "cloth", "extra": "cloth", "skin": "skin", "hair": "hair", "shoes": "leather"}
_CLASSES = {"extra": "cloth"}
_CAPSULE_RADIUS_M = 0.27


def person_xml(person: Person, pose: Pose, groups: Iterable[str], key_points: KeyPoints) -> str:
    """Returns the MJCF text of a person in a pose, with the given groups of meshes and key points."""
    groups = list(groups)
    classes = sorted({f"person.{_CLASSES.get(group, group)}" for group in groups})
    first = " ".join(f"{value:g}" for value in person.palette[0][:3])
    geoms = []
    for group in groups:
        colour = f' rgba="{first} 1"' if group == "paint" else ""
        geoms.append(
            f'      <geom name="{group}" class="person.{_CLASSES.get(group, group)}" mesh="{pose.name}_{group}"'
            f' material="{_MATERIALS[group]}"{colour}/>'
        )
    radius = _CAPSULE_RADIUS_M * min(1.0, person.build.height_m / 1.6)
    return _XML.format(
        name=person.name,
        pose=pose.name,
        kind=pose.kind,
        palette="  ".join(" ".join(f"{value:g}" for value in row) for row in person.palette),
        key_points=key_point_lines(key_points),
        classes="\n".join(f'      <default class="{name}"/>' for name in classes),
        meshes="\n".join(f'    <mesh class="seen" file="{pose.name}_{group}.obj"/>' for group in groups),
        geoms="\n".join(geoms),
        radius=radius,
        top=person.build.height_m - radius,
    )


def write_textures(out: Path, person: Person) -> None:
    """Writes the two textures of a person into the person's folder."""
    folder = out / person.name
    folder.mkdir(parents=True, exist_ok=True)
    write_atlas(folder / "cloth.png", person.atlas)
    write_skin(folder / "skin.png", person.face)


def write_person(out: Path, person: Person, pose: Pose) -> None:
    """Writes the meshes and the MJCF file of one pose of a person."""
    folder = out / person.name
    folder.mkdir(parents=True, exist_ok=True)
    figure = model_person(person, pose)
    groups = [group for group in GROUPS if group in figure.meshes]
    for group in groups:
        write_obj(folder / f"{pose.name}_{group}.obj", figure.meshes[group])
    text = person_xml(person, pose, groups, figure.key_points)
    (out / f"{person.name}_{pose.name}.xml").write_text(text, encoding="utf-8")
