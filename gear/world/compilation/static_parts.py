"""Splits MJCF files into the part that dm_control must read and parts that are copied into the world unchanged.

dm_control would not change the copied parts, and it is slow: half a millisecond for each geom and body of a town, and
five for each default class of an asset. dm_control would also read, hash and rewrite every mesh. It therefore gets the
path of a mesh file instead of the content.
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
from gear.world.assets.library import KEY_POINT, read_numbers
from gear.world.assets.scene_assets import AssetFile
from gear.world.compilation.board_scaling import scale_board

UNNAMED = "unnamed_"
"""Prefix of the names that gear gives to elements without a name."""

_PLAIN = ("geom", "body")
_PLAIN_DEFAULTS = ("default", "geom", "mesh")
_REFERENCES = frozenset({"material", "mesh", "hfield", "fluidshape"})
_PLAIN_STEM = re.compile(r"[\w.-]+", re.ASCII)
_MAIN = "main"
"""Name of the root default class in MJCF files that MuJoCo writes."""

_WORLD = "<worldbody>"


class MeshPath(bytes):
    """The encoded path (`os.fsencode`) of a mesh file, passed to dm_control instead of the file's content."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticParts:
    """The geoms and bodies of a town's worldbody that are not passed through dm_control, in the order of the file.

    Attributes:
        xml: the elements as MJCF; every geom has a name.
        body_names: names of all bodies in these elements.
        geom_materials: distinct pairs of default class and own material (None for none) of the geoms, in the order of
            the file.
    """

    xml: str = ""
    body_names: frozenset[str] = frozenset()
    geom_materials: tuple[tuple[str, str | None], ...] = ()

    def insert_into(self, xml: str) -> str:
        """Inserts these elements at the start of the worldbody of an MJCF text. Returns the new text.

        Args:
            xml: MJCF text of the world, as dm_control wrote it.
        """
        before, world, after = xml.partition(_WORLD)
        return before + world + self.xml + after if self.xml else xml


@dataclass(frozen=True, slots=True, kw_only=True)
class SplitTown:
    """A town's MJCF in two parts: the part for dm_control, and the part that is copied as text.

    Attributes:
        path: path of its file.
        text: the MJCF for dm_control; None if dm_control must read the file itself.
        statics: the parts that were taken out of the text.
        mesh_paths: path of each mesh file, by its name in `text`.
    """

    path: Path
    text: str | None
    statics: StaticParts
    mesh_paths: Mapping[str, MeshPath] = field(default_factory=dict)


def split_town(path: Path) -> SplitTown:
    """Separates the plain geoms and bodies of a town from the rest of its MJCF.

    A town is not split if it includes other files, or if its worldbody has other elements (joints, cameras, sites,
    geoms without a class). dm_control then reads the file itself. There is one exception: if such a file calls its root
    default class `main`, dm_control gets a text without that name, because it would make a second class.

    Args:
        path: path of the town's MJCF file.

    Raises:
        TownError: the file is not XML, cannot be read, or contains a NaN.
    """
    root = read_numbers(path)
    named = [default for default in root.findall("default") if default.get("class") == _MAIN]
    for default in named:
        del default.attrib["class"]
    worlds = root.findall("worldbody")
    taken = [child for world in worlds for child in world if child.tag in _PLAIN]
    if len(worlds) != 1 or next(root.iter("include"), None) is not None or not all(map(_is_plain, taken)):
        return SplitTown(
            path=path, text=ET.tostring(root, encoding="unicode") if named else None, statics=StaticParts()
        )
    for child in taken:
        worlds[0].remove(child)
    geoms = [geom for child in taken for geom in child.iter("geom")]
    for index, geom in enumerate(geoms):
        geom.attrib.setdefault("name", f"{UNNAMED}geom_{index}")
    statics = StaticParts(
        xml="".join(ET.tostring(child, encoding="unicode") for child in taken),
        body_names=frozenset(body.get("name", "") for child in taken for body in child.iter("body")),
        geom_materials=tuple(dict.fromkeys((geom.get("class", ""), geom.get("material")) for geom in geoms)),
    )
    mesh_paths = _replace_mesh_names(root, path)
    return SplitTown(path=path, text=ET.tostring(root, encoding="unicode"), statics=statics, mesh_paths=mesh_paths)


@dataclass(frozen=True, slots=True, kw_only=True)
class SplitAsset:
    """An asset's MJCF in two parts: the part for dm_control, and the default classes.

    Attributes:
        text: the MJCF without its default classes and key points; None if dm_control must read the file itself.
        defaults: the default classes as MJCF, with the names that dm_control gives them in a composed world.
        mesh_paths: path of each mesh file, by its name in `text`.
    """

    text: str | None = None
    defaults: str = ""
    mesh_paths: Mapping[str, MeshPath] = field(default_factory=dict)


def split_asset(file: AssetFile) -> SplitAsset:
    """Separates the default classes of an asset from the rest of its MJCF.

    If `file.face_size_m` is set, the asset is first scaled to this size of its face in metres.

    A file is not split if it includes other files, or if its default classes refer to other elements (such as a
    material) or apply to elements other than geoms and meshes.

    Args:
        file: file of the asset, a board or an actor.

    Raises:
        TownError: the file is not XML, cannot be read, contains a NaN, or cannot be scaled.
    """
    path = file.path
    root = read_numbers(path)
    if file.face_size_m is not None:
        scale_board(root, path, file.face_size_m)
    sections = root.findall("default")
    if (
        len(sections) != 1
        or sections[0].attrib
        or next(root.iter("include"), None) is not None
        or not _PLAIN_STEM.fullmatch(file.name)
        or not all(part.tag in _PLAIN_DEFAULTS and _REFERENCES.isdisjoint(part.keys()) for part in sections[0].iter())
    ):
        return SplitAsset(text=None if file.face_size_m is None else ET.tostring(root, encoding="unicode"))
    root.remove(sections[0])
    _remove_key_points(root)
    for default in sections[0].iter("default"):
        default.set("class", f"{file.name}/{default.get('class', '')}")
    mesh_paths = _replace_mesh_names(root, path)
    return SplitAsset(
        text=ET.tostring(root, encoding="unicode"),
        defaults=ET.tostring(sections[0], encoding="unicode").strip(),
        mesh_paths=mesh_paths,
    )


def _remove_key_points(root: ET.Element) -> None:
    """Removes key points from a tree. `read_actor_facts` reads them, and the compiled world has no use for them."""
    for section in root.iter("custom"):
        for entry in [one for one in section if one.get("name", "").startswith(KEY_POINT)]:
            section.remove(entry)


def _replace_mesh_names(root: ET.Element, path: Path) -> dict[str, MeshPath]:
    """Replaces the name of each mesh file in a tree by its absolute path, and returns the paths by these new names."""
    folders = {name: folder for part in root.iter("compiler") for name, folder in part.items()}
    base = path.parent / folders.get("meshdir", folders.get("assetdir", ""))
    mesh_paths: dict[str, MeshPath] = {}
    for mesh in root.iterfind("asset/mesh[@file]"):
        file = (base / mesh.get("file", "")).absolute()
        try:
            # MuJoCo reads the content later. Opening the file here finds a missing one while its MJCF is known.
            with check_regular(file).open("rb"):
                mesh_paths[str(file)] = MeshPath(os.fsencode(file))
        except OSError as error:
            raise TownError(path, f"cannot be read as MJCF: {error}") from error
        mesh.set("file", str(file))
    return mesh_paths


def _is_plain(element: ET.Element) -> bool:
    """Whether an element and its descendants are all geoms with a class and bodies with a name."""
    return all(
        part.tag in _PLAIN
        and part.get("childclass") is None
        and not part.get("name", "").startswith(UNNAMED)
        and part.get("class" if part.tag == "geom" else "name") is not None
        for part in element.iter()
    )
