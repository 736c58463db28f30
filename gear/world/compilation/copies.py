"""Copies the first instance of an asset as text in the MJCF that dm_control wrote.

Instances of an asset differ only in names and number plates. dm_control needs nearly two milliseconds per instance,
three quarters of a second for the actors of a town. Copying text is faster.
"""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Copy:
    """One copy of an asset's first instance.

    Attributes:
        name: name of the copy's body.
        original: name of the copied body; the names of all elements in that body start with it.
        plates: meshes of the copy's number plates, by the names of the plates' geoms in the asset's file.
    """

    name: str
    original: str
    plates: Mapping[str, str]


def put_copies_into(world: ET.Element, copies: Mapping[str, Sequence[Copy]]) -> None:
    """Inserts copies of instances into the `<worldbody>` element of an MJCF tree.

    Args:
        world: the worldbody, changed in place.
        copies: the copies, by the name of the body after which they are inserted.
    """
    bodies = {body.get("name", ""): body for body in world.iterfind("body")}
    for index, element in reversed(list(enumerate(world))):
        wanted = copies.get(element.get("name", ""), ()) if element.tag == "body" else ()
        world[index + 1 : index + 1] = [_copied(bodies[one.original], one) for one in wanted]


def _copied(body: ET.Element, wanted: Copy) -> ET.Element:
    copied = copy.deepcopy(body)
    for element in copied.iter():
        if name := element.get("name"):
            element.set("name", wanted.name + name[len(wanted.original) :])
    for geom in copied.iter("geom"):
        asset_name = geom.get("name", "")[len(wanted.name) + 1 :]
        if asset_name in wanted.plates:
            geom.set("mesh", wanted.plates[asset_name])
    return copied
