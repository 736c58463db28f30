"""What stays as its file says and goes around dm_control, which would change nothing: geoms and bodies of a town, half a
millisecond for each of them, and default classes of assets, five milliseconds each."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

from gear.values.errors import TownError

UNNAMED = "unnamed_"
"""How names begin that gear gives to what has none."""

_PLAIN = ("geom", "body")
_PLAIN_DEFAULTS = ("default", "geom", "mesh")
_REFERENCES = frozenset({"material", "mesh", "hfield", "fluidshape"})
_PLAIN_STEM = re.compile(r"[\w.-]+")
_WORLD = "<worldbody>"


@dataclass(frozen=True, slots=True, kw_only=True)
class Statics:
    """Elements of a town's worldbody, in their order.

    Attributes:
        xml: as MJCF; every geom has a name.
        body_names: of the bodies.
        worn: default class and own material, if it has one, of the geoms; each pair once, in the order of the file.
    """

    xml: str = ""
    body_names: frozenset[str] = frozenset()
    worn: tuple[tuple[str, str | None], ...] = ()

    def put_into(self, xml: str) -> str:
        """MJCF with them before everything else in its worldbody."""
        before, world, after = xml.partition(_WORLD)
        return before + world + self.xml + after if self.xml else xml


def split_town(path: Path) -> tuple[str | None, Statics]:
    """A town's MJCF without its geoms and bodies, and those.

    Nothing is taken out of a town whose geoms and bodies are not all plain ones: such with joints, cameras or sites in
    them, geoms without a class of their own, or files that include others. dm_control reads such a file itself: the
    text is None.

    Raises:
        TownError: it is no XML, or cannot be read.
    """
    root = _parsed(path)
    worlds = root.findall("worldbody")
    taken = [child for world in worlds for child in world if child.tag in _PLAIN]
    if len(worlds) != 1 or next(root.iter("include"), None) is not None or not all(map(_is_plain, taken)):
        return None, Statics()
    for child in taken:
        worlds[0].remove(child)
    geoms = [geom for child in taken for geom in child.iter("geom")]
    for index, geom in enumerate(geoms):
        geom.attrib.setdefault("name", f"{UNNAMED}geom_{index}")
    statics = Statics(
        xml="".join(ET.tostring(child, encoding="unicode") for child in taken),
        body_names=frozenset(body.get("name", "") for child in taken for body in child.iter("body")),
        worn=tuple(dict.fromkeys((geom.get("class", ""), geom.get("material")) for geom in geoms)),
    )
    return ET.tostring(root, encoding="unicode"), statics


def split_asset(path: Path) -> tuple[str | None, str]:
    """An asset's MJCF without its default classes, and those, named as dm_control names them in a town.

    A file whose classes are more than geoms and meshes without references is left whole: the text is None.

    Raises:
        TownError: it is no XML, or cannot be read.
    """
    root = _parsed(path)
    sections = root.findall("default")
    if (
        len(sections) != 1
        or sections[0].attrib
        or next(root.iter("include"), None) is not None
        or not _PLAIN_STEM.fullmatch(path.stem)
        or not all(part.tag in _PLAIN_DEFAULTS and _REFERENCES.isdisjoint(part.keys()) for part in sections[0].iter())
    ):
        return None, ""
    root.remove(sections[0])
    for default in sections[0].iter("default"):
        default.set("class", f"{path.stem}/{default.get('class', '')}")
    return ET.tostring(root, encoding="unicode"), ET.tostring(sections[0], encoding="unicode").strip()


def _parsed(path: Path) -> ET.Element:
    try:
        return ET.parse(path).getroot()
    except (OSError, ET.ParseError) as error:
        raise TownError(path, f"cannot be read as MJCF: {error}") from error


def _is_plain(element: ET.Element) -> bool:
    return all(
        part.tag in _PLAIN
        and part.get("childclass") is None
        and not part.get("name", "").startswith(UNNAMED)
        and part.get("class" if part.tag == "geom" else "name") is not None
        for part in element.iter()
    )
