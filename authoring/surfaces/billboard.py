"""The roadside billboard as MJCF: meshes, face texture and the XML that ties them together."""

from __future__ import annotations

from pathlib import Path

from authoring.mesh import write_obj
from authoring.surfaces import structure
from authoring.surfaces.face import write_neutral_face

_MESHES = {
    "posts": structure.posts,
    "footings": structure.footings,
    "frame": structure.frame,
    "back": structure.back_panel,
    "lamps": structure.lamps,
    "face": structure.face,
}

_XML = """<mujoco model="billboard">
  <!-- Made by `python -m authoring.surfaces`. The board faces +x; the origin is on the ground under the middle of its
       face. The face is {width} m x {height} m with its centre at z = {centre} m: over the bonnets of parked cars. -->
  <compiler angle="degree" meshdir="billboard" texturedir="billboard"/>
  <default>
    <default class="seen">
      <mesh inertia="shell"/>
      <geom type="mesh" group="1" contype="0" conaffinity="0" mass="0"/>
      <default class="pole.steel"/>
      <default class="billboard.footing"/>
      <default class="billboard.frame"/>
      <default class="billboard.back"/>
      <default class="billboard.lamp"/>
      <default class="billboard.face"/>
    </default>
    <default class="collision">
      <geom type="box" group="3"/>
    </default>
  </default>
  <asset>
    <mesh class="seen" file="posts.obj"/>
    <mesh class="seen" file="footings.obj"/>
    <mesh class="seen" file="frame.obj"/>
    <mesh class="seen" file="back.obj"/>
    <mesh class="seen" file="lamps.obj"/>
    <mesh class="seen" file="face.obj"/>
    <texture name="face" type="2d" file="face.png" colorspace="sRGB"/>
    <material name="galvanised" rgba="0.36 0.37 0.38 1" metallic="0" roughness="0.55"/>
    <material name="concrete" rgba="0.42 0.41 0.39 1" metallic="0" roughness="0.95"/>
    <material name="frame" rgba="0.11 0.12 0.13 1" metallic="0" roughness="0.5"/>
    <material name="panel" rgba="0.30 0.31 0.31 1" metallic="0" roughness="0.7"/>
    <material name="lamp" rgba="0.16 0.16 0.17 1" metallic="0" roughness="0.45"/>
    <material name="face" texture="face" metallic="0" roughness="0.9"/>
  </asset>
  <worldbody>
    <body name="billboard">
      <geom class="pole.steel" mesh="posts" material="galvanised"/>
      <geom class="billboard.footing" mesh="footings" material="concrete"/>
      <geom class="billboard.frame" mesh="frame" material="frame"/>
      <geom class="billboard.back" mesh="back" material="panel"/>
      <geom class="billboard.lamp" mesh="lamps" material="lamp"/>
      <geom name="face" class="billboard.face" mesh="face" material="face"/>
      <site name="surface" pos="0 0 {centre}" xyaxes="0 1 0 0 0 -1" size="0.01" group="4"/>
      <geom name="board" class="collision" pos="-0.6 0 {centre}" size="0.6 3.8 1.95"/>
      <geom name="post_right" class="collision" pos="-0.42 2.35 0.4" size="0.4 0.4 0.4"/>
      <geom name="post_left" class="collision" pos="-0.42 -2.35 0.4" size="0.4 0.4 0.4"/>
    </body>
  </worldbody>
</mujoco>
"""


def write_billboard(out: Path) -> None:
    """Write `billboard.xml` and its folder of meshes and texture into `out`."""
    folder = out / "billboard"
    folder.mkdir(parents=True, exist_ok=True)
    for name, build in _MESHES.items():
        write_obj(folder / f"{name}.obj", build())
    write_neutral_face(folder / "face.png")
    xml = _XML.format(width=structure.FACE_WIDTH_M, height=structure.FACE_HEIGHT_M, centre=structure.FACE_CENTRE_Z_M)
    (out / "billboard.xml").write_text(xml, encoding="utf-8")
