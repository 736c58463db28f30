"""Writes the files of a vehicle: paint textures with shut lines, OBJ meshes, and MJCF."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from authoring.mesh import Floats, Mesh, merge, write_obj
from authoring.vehicles.atlas import cell_uvs, plate_cells
from authoring.vehicles.grooves import Line, carve

__all__ = ["PALETTES", "Box", "Finish", "PaintMap", "write_vehicle"]

_DARK, _DARK_PX, _RAMP_PX = 56 / 255, 40, 3
"""How dark shut lines are at their bottoms, how large a square shows that (in mip levels it is to be dark, too), and
how much of the texture lies between a lip and the bottom.
"""

PALETTES = {
    # Linear albedo and weight; the weights follow what European registrations look like.
    "car": (
        (0.70, 0.70, 0.69, 26), (0.020, 0.020, 0.022, 20), (0.10, 0.105, 0.11, 21), (0.42, 0.43, 0.44, 10),
        (0.022, 0.060, 0.17, 8), (0.03, 0.11, 0.30, 3), (0.34, 0.018, 0.016, 5), (0.13, 0.012, 0.018, 2),
        (0.030, 0.065, 0.040, 2), (0.22, 0.17, 0.12, 2), (0.55, 0.18, 0.02, 1),
    ),
    "van": (
        (0.72, 0.72, 0.71, 62), (0.40, 0.41, 0.42, 10), (0.05, 0.05, 0.055, 8), (0.03, 0.08, 0.22, 8),
        (0.32, 0.02, 0.018, 4), (0.62, 0.36, 0.02, 4), (0.10, 0.105, 0.11, 4),
    ),
    "taxi": ((0.66, 0.42, 0.015, 3), (0.72, 0.68, 0.52, 2)),
    "bus": ((0.42, 0.02, 0.018, 3), (0.05, 0.16, 0.34, 3), (0.70, 0.70, 0.69, 3), (0.05, 0.22, 0.09, 1)),
    "truck": ((0.72, 0.72, 0.71, 5), (0.03, 0.08, 0.24, 2), (0.34, 0.018, 0.016, 2), (0.06, 0.20, 0.10, 1)),
    "white": ((0.72, 0.72, 0.71, 1),),
}  # fmt: skip


@dataclass(frozen=True)
class PaintMap:
    """The layout of the paint texture, and the shut lines that are cut into the paint.

    The map has a side view (x, z) at the bottom, a top view (x, |y|) above it, then front and rear views (|y|, z) side
    by side: both sides of a vehicle share their texels.

    Attributes:
        low, high: (3,) bounds of the painted parts, metres.
        size: (width, height) of the texture in pixels.
        side, top, front, rear: polylines of shut lines in metres, as in `carve`.
    """

    low: Floats
    high: Floats
    size: tuple[int, int]
    side: tuple[Line, ...] = ()
    top: tuple[Line, ...] = ()
    front: tuple[Line, ...] = ()
    rear: tuple[Line, ...] = ()

    @property
    def _scale(self) -> tuple[float, tuple[float, float, float]]:
        """Pixels per metre and the three rows' lower edges in pixels from the bottom."""
        length, half, tall = self.high[0] - self.low[0], self.high[1], self.high[2] - self.low[2]
        gap = 8
        per_metre = min((self.size[0] - 2 * gap) / length, (self.size[1] - 4 * gap) / (2 * tall + half))
        rows = (gap, 2 * gap + tall * per_metre, 3 * gap + (tall + half) * per_metre)
        return per_metre, rows

    def pixel(self, view: str, a: Floats, b: Floats) -> Floats:
        """(N, 2) pixels, right and up, of view coordinates: (x, z), (x, |y|) or (|y|, z)."""
        per_metre, rows = self._scale
        if view in ("side", "top"):
            right = 8 + (a - self.low[0]) * per_metre
            up = rows[0] + (b - self.low[2]) * per_metre if view == "side" else rows[1] + b * per_metre
        else:
            shift = 0.0 if view == "front" else self.size[0] / 2
            right, up = 8 + shift + a * per_metre, rows[2] + (b - self.low[2]) * per_metre
        return np.stack([right, up], axis=-1)

    def unwrap(self, mesh: Mesh) -> Mesh:
        """Assigns each face to the view in its direction; vertices between two views are doubled."""
        corners = mesh.vertices[mesh.faces]
        normal = np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
        facing = normal.argmax(axis=1)
        ahead = corners.mean(axis=1)[:, 0] > (self.low[0] + self.high[0]) / 2
        view = np.where(facing == 1, 0, np.where(facing == 2, 1, np.where(ahead, 2, 3)))
        pieces = []
        for k, name in enumerate(("side", "top", "front", "rear")):
            piece = mesh.part(mesh.faces[view == k])
            p = piece.vertices
            a = np.abs(p[:, 1]) if k > 1 else p[:, 0]
            b = np.abs(p[:, 1]) if k == 1 else p[:, 2]
            pieces.append(piece.with_uvs(self.pixel(name, a, b) / np.array(self.size)))
        return merge(pieces)

    @property
    def _dark(self) -> tuple[int, int]:
        """The left upper corner of the dark square, `_DARK_PX` wide, in pixels from above: no view comes near it."""
        return self.size[0] - _DARK_PX - 8, 8

    def carved(self, mesh: Mesh) -> Mesh:
        """The unwrapped mesh with grooves along the shut lines, which darken from their lips to their bottoms."""
        left, top = self._dark
        right, up = left + _DARK_PX / 2, self.size[1] - top - _DARK_PX
        shade = np.array([[right, up - _RAMP_PX / 2], [right, up + _RAMP_PX / 2]]) / np.array(self.size)
        views = {"side": self.side, "top": self.top, "front": self.front, "rear": self.rear}
        return carve(self.unwrap(mesh), views, shade)

    def draw(self, path: Path) -> None:
        """Writes the texture: white, with some road dirt low down, and the dark of shut lines in a corner."""
        width, height = self.size
        per_metre = self._scale[0]
        value = np.ones((height, width))
        left, top = self._dark
        value[top : top + _DARK_PX, left : left + _DARK_PX] = _DARK
        rows = self._scale[1]
        up = height - 1 - np.arange(height)
        z = (up - rows[0]) / per_metre + self.low[2]
        dirt = np.where(up < rows[1], 1 - 0.22 * np.clip((0.45 - z) / 0.3, 0, 1), 1.0)
        image = np.clip(np.rint(value * dirt[:, None] * 255), 0, 255).astype(np.uint8)
        Image.fromarray(image).convert("RGB").quantize(64, dither=Image.Dither.NONE).save(path, optimize=True)


@dataclass(frozen=True)
class Box:
    """A collision box: half sizes and centre, metres."""

    size: tuple[float, float, float]
    at: tuple[float, float, float]


@dataclass(frozen=True)
class Finish:
    """How a vehicle is written.

    Attributes:
        name: name of the file without its ending.
        kind: `actor.kind`: car, van, truck or bus; also the prefix of the classes.
        palette: a key of `PALETTES`.
        boxes: collision boxes.
        metallic, roughness: material of the paint.
        comment: comment at the start of the file.
        shown: number of the palette's colour in the file itself.
        own_inside: whether the glass shows `<name>/inside.png` rather than `common/inside.png`.
    """

    name: str
    kind: str
    palette: str
    boxes: tuple[Box, ...]
    metallic: float = 0.12
    roughness: float = 0.15
    comment: str = ""
    shown: int = 0
    own_inside: bool = False


_MATERIALS = {
    "glass": 'texture="inside" metallic="0" roughness="0.05"',
    "trim": 'texture="details" metallic="0" roughness="0.5"',
    "lights": 'texture="lamps" metallic="0" roughness="0.08"',
    "tyre": 'rgba="0.022 0.022 0.023 1" metallic="0" roughness="0.85"',
    "rim": 'rgba="0.60 0.61 0.62 1" metallic="0.6" roughness="0.32"',
    "chrome": 'rgba="0.62 0.62 0.63 1" metallic="1" roughness="0.12"',
    "body": 'rgba="0.62 0.62 0.61 1" metallic="0" roughness="0.45"',
    "plate": 'texture="plates" metallic="0" roughness="0.4"',
}


def write_vehicle(
    out: Path, finish: Finish, meshes: dict[str, Mesh], paint_map: PaintMap, *, face: tuple[str, str, str] | None = None
) -> None:
    """Writes `<name>.xml` and `<name>/*.obj`, `<name>/paint.png`.

    Args:
        out: the folder of vehicles.
        finish: names, colours and boxes.
        meshes: by material: paint, glass, trim, lights, tyre, rim, chrome, body, plate.
        paint_map: layout of the paint texture.
        face: for a patchable truck, its extra asset, geom and site lines.
    """
    folder = out / finish.name
    folder.mkdir(parents=True, exist_ok=True)
    skin = paint_map.carved(meshes["paint"])
    paint_map.draw(folder / "paint.png")
    names = [n for n in ("paint", *_MATERIALS) if n in meshes]
    for name in names[:-1]:
        write_obj(folder / f"{name}.obj", skin if name == "paint" else meshes[name])
    kind, stem = finish.kind, finish.name
    inside = f"{stem if finish.own_inside else 'common'}/inside.png"
    rgb = " ".join(f"{v:g}" for v in PALETTES[finish.palette][finish.shown][:3])
    palette = "  ".join(" ".join(f"{v:g}" for v in row) for row in PALETTES[finish.palette])
    lines = [
        f'<mujoco model="{stem}">',
        f"  <!-- Made by `python -m authoring.vehicles`. {finish.comment} -->",
        '  <compiler angle="degree" meshdir="." texturedir="."/>',
        "  <default>",
        '    <default class="seen">',
        '      <mesh inertia="shell"/>',
        '      <geom type="mesh" group="1" contype="0" conaffinity="0" mass="0"/>',
        *(f'      <default class="{kind}.{n}"/>' for n in names),
        *([f'      <default class="{kind}.face"/>'] if face else []),
        "    </default>",
        '    <default class="collision">',
        '      <geom type="box" group="3" rgba="0.2 0.8 0.3 0.4"/>',
        "    </default>",
        "  </default>",
        "  <asset>",
        *(f'    <mesh class="seen" name="{n}" file="{stem}/{n}.obj"/>' for n in names[:-1]),
        *_plates(stem, meshes["plate"]),
        f'    <texture name="paint" type="2d" file="{stem}/paint.png" colorspace="sRGB"/>',
        '    <texture name="details" type="2d" file="common/details.png" colorspace="sRGB"/>',
        '    <texture name="plates" type="2d" file="common/plates.png" colorspace="sRGB"/>',
        '    <texture name="lamps" type="2d" file="common/lamps.png" colorspace="sRGB"/>',
        f'    <texture name="inside" type="2d" file="{inside}" colorspace="sRGB"/>',
        f'    <material name="paint" texture="paint" rgba="{rgb} 1" metallic="{finish.metallic:g}" '
        f'roughness="{finish.roughness:g}"/>',
        *(f'    <material name="{n}" {_MATERIALS[n]}/>' for n in names if n != "paint"),
        *([face[0]] if face else []),
        "  </asset>",
        "  <worldbody>",
        f'    <body name="{stem}">',
        *(f'      <geom class="{kind}.{n}" mesh="{n}" material="{n}"/>' for n in names),
        *(list(face[1:]) if face else []),
        *(
            f'      <geom class="collision" size="{" ".join(f"{v:g}" for v in b.size)}" '
            f'pos="{" ".join(f"{v:g}" for v in b.at)}"/>'
            for b in finish.boxes
        ),
        "    </body>",
        "  </worldbody>",
        "  <custom>",
        f'    <text name="actor.kind" data="{kind}"/>',
        f'    <numeric name="paint.palette" data="{palette}"/>',
        "  </custom>",
        "</mujoco>",
    ]
    (out / f"{stem}.xml").write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")


def _plates(name: str, mesh: Mesh) -> list[str]:
    """Returns number plates with one text each, which the instances have in turn."""
    vertices = "  ".join(" ".join(f"{v:.4g}" for v in row) for row in mesh.vertices)
    faces = "  ".join(" ".join(str(v) for v in row) for row in mesh.faces)
    lines = []
    for k, cell in enumerate(plate_cells(name)):
        uvs = cell_uvs(cell, mesh.uvs)
        # What stands in a file of MJCF counts v down, as the picture's rows do.
        texture = "  ".join(f"{u:.5g} {1 - v:.5g}" for u, v in uvs)
        lines.append(
            f'    <mesh class="seen" name="plate{f"_{k}" if k else ""}" vertex="{vertices}"\n'
            f'          texcoord="{texture}" face="{faces}"/>'
        )
    return lines
