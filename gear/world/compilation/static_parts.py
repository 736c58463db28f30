"""What stays as its file says and goes around dm_control, which would change nothing.

Geoms and bodies of a town cost it half a millisecond each, default classes of assets five. Meshes it would read, hash
and have written again: it gets their paths for their content.
"""

from __future__ import annotations

import os
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from gear.values.errors import TownError
from gear.values.regular_file import check_regular
from gear.world.assets.library import read_numbers

UNNAMED = "unnamed_"
"""How names begin that gear gives to what has none."""

_PLAIN = ("geom", "body")
_PLAIN_DEFAULTS = ("default", "geom", "mesh")
_REFERENCES = frozenset({"material", "mesh", "hfield", "fluidshape"})
_PLAIN_STEM = re.compile(r"[\w.-]+", re.ASCII)
_MAIN = "main"
"""MuJoCo's own name of the class of all defaults: in files that it has written."""

_WORLD = "<worldbody>"


class MeshPath(bytes):
    """Where a file lies, for its content."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticParts:
    """Elements of a town's worldbody, in their order.

    Attributes:
        xml: as MJCF; every geom has a name.
        body_names: of the bodies.
        geom_materials: default class and own material, if it has one, of the geoms; each pair once, in the order of the
            file.
        mesh_paths: of the meshes, by what the rest of the town calls their files.
    """

    xml: str = ""
    body_names: frozenset[str] = frozenset()
    geom_materials: tuple[tuple[str, str | None], ...] = ()
    mesh_paths: Mapping[str, MeshPath] = field(default_factory=dict)

    def put_into(self, xml: str) -> str:
        """MJCF with them before everything else in its worldbody."""
        before, world, after = xml.partition(_WORLD)
        return before + world + self.xml + after if self.xml else xml


def split_town(path: Path) -> tuple[str | None, StaticParts]:
    """A town's MJCF without its geoms and bodies, and those.

    Nothing is taken out of a town whose geoms and bodies are not all plain ones: such with joints, cameras or sites in
    them, geoms without a class of their own, or files that include others. dm_control reads such a file itself: the
    text is None, unless the class of all defaults has its usual name, which dm_control would make another class.

    Raises:
        TownError: it is no XML, or cannot be read.
    """
    root = read_numbers(path)
    named = [default for default in root.findall("default") if default.get("class") == _MAIN]
    for default in named:
        del default.attrib["class"]
    worlds = root.findall("worldbody")
    taken = [child for world in worlds for child in world if child.tag in _PLAIN]
    if len(worlds) != 1 or next(root.iter("include"), None) is not None or not all(map(_is_plain, taken)):
        return ET.tostring(root, encoding="unicode") if named else None, StaticParts()
    for child in taken:
        worlds[0].remove(child)
    geoms = [geom for child in taken for geom in child.iter("geom")]
    for index, geom in enumerate(geoms):
        geom.attrib.setdefault("name", f"{UNNAMED}geom_{index}")
    statics = StaticParts(
        xml="".join(ET.tostring(child, encoding="unicode") for child in taken),
        body_names=frozenset(body.get("name", "") for child in taken for body in child.iter("body")),
        geom_materials=tuple(dict.fromkeys((geom.get("class", ""), geom.get("material")) for geom in geoms)),
        mesh_paths=_meshes_in_place(root, path),
    )
    return ET.tostring(root, encoding="unicode"), statics


@dataclass(frozen=True, slots=True, kw_only=True)
class SplitAsset:
    """An asset's MJCF in two.

    Attributes:
        text: without its default classes; None where it is to be read whole.
        defaults: those, named as dm_control names them in a town.
        mesh_paths: of the meshes, by what `text` calls their files.
    """

    text: str | None = None
    defaults: str = ""
    mesh_paths: Mapping[str, MeshPath] = field(default_factory=dict)


def split_asset(path: Path) -> SplitAsset:
    """Takes out default classes of geoms and meshes; a file whose classes refer to anything is left whole.

    Raises:
        TownError: it is no XML, or a file cannot be read.
    """
    root = read_numbers(path)
    sections = root.findall("default")
    if (
        len(sections) != 1
        or sections[0].attrib
        or next(root.iter("include"), None) is not None
        or not _PLAIN_STEM.fullmatch(path.stem)
        or not all(part.tag in _PLAIN_DEFAULTS and _REFERENCES.isdisjoint(part.keys()) for part in sections[0].iter())
    ):
        return SplitAsset()
    root.remove(sections[0])
    for default in sections[0].iter("default"):
        default.set("class", f"{path.stem}/{default.get('class', '')}")
    mesh_paths = _meshes_in_place(root, path)
    return SplitAsset(
        text=ET.tostring(root, encoding="unicode"),
        defaults=ET.tostring(sections[0], encoding="unicode").strip(),
        mesh_paths=mesh_paths,
    )


def _meshes_in_place(root: ET.Element, path: Path) -> dict[str, MeshPath]:
    """Has meshes named by their whole paths, and where those lead to."""
    folders = {name: folder for part in root.iter("compiler") for name, folder in part.items()}
    base = path.parent / folders.get("meshdir", folders.get("assetdir", ""))
    mesh_paths: dict[str, MeshPath] = {}
    for mesh in root.iterfind("asset/mesh[@file]"):
        file = (base / mesh.get("file", "")).absolute()
        try:
            # MuJoCo is the one to read it: whether that is possible, and which file it is, shows here.
            with check_regular(file).open("rb"):
                mesh_paths[str(file)] = MeshPath(os.fsencode(file))
        except OSError as error:
            raise TownError(path, f"cannot be read as MJCF: {error}") from error
        mesh.set("file", str(file))
    return mesh_paths


def _is_plain(element: ET.Element) -> bool:
    return all(
        part.tag in _PLAIN
        and part.get("childclass") is None
        and not part.get("name", "").startswith(UNNAMED)
        and part.get("class" if part.tag == "geom" else "name") is not None
        for part in element.iter()
    )
