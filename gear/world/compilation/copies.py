"""Copies of an asset's first instance, made in the MJCF that dm_control wrote.

Instances of one asset differ in names and number plates alone. dm_control takes nearly two milliseconds to make each,
three quarters of a second for the crowd of a town.
"""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Copy:
    """One copy of an instance.

    Attributes:
        name: name of its body.
        original: name of the body that it is a copy of. The names of all elements in that body begin with it.
        plates: meshes of its number plates, by the names that the asset's file gives to their geoms.
    """

    name: str
    original: str
    plates: Mapping[str, str]


def put_copies_into(world: ET.Element, copies: Mapping[str, Sequence[Copy]]) -> None:
    """Inserts copies into a `<worldbody>`.

    Args:
        world: the worldbody, changed in place.
        copies: the copies to insert, by the name of the body that they follow.
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
