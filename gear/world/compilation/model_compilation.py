"""Compiles the two models of a composed world: the render model and the placement model."""

from __future__ import annotations

import contextlib
import copy
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import mujoco

from gear.values.errors import TownError
from gear.world.assets.geom_classes import GeomClasses, classify, unprefixed_class
from gear.world.assets.mjspec import accept_flat_bodies
from gear.world.compilation.compose import Composition
from gear.world.compilation.materials import reject_fatal_textures
from gear.world.compilation.mujoco_errors import compile_error

COLLISION_CLASS = "collision"
GROUND_PREFIX = "ground"

GROUND_GROUP, OBSTACLE_GROUP, ACTOR_GROUP, FOOT_GROUP = 0, 1, 2, 3
"""Geom groups of the placement model, by which a ray can be limited to some kinds of geoms."""

_BODIES, _FEET = "1", "2"
"""Contact bits: bodies of actors collide with each other and with obstacles, feet of actors with the ground."""

FOOT_RADIUS_M = 0.05
_CORNERS = ((1, 1), (1, -1), (-1, 1), (-1, -1))

_OPAQUE = "1 1 1 1"
"""Colour of collision geoms. It is opaque, because rays pass through geoms with alpha 0."""

_ASSET_REFERENCES = ("material", "mesh", "hfield")
_PLACEMENT_SECTIONS = ("compiler", "size", "default", "worldbody", "custom")
"""Sections of the MJCF that the placement model contains. The town's `<option>` is left out, because it could
switch contacts or gravity off.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacementBody:
    """The body of an actor in the placement model.

    Attributes:
        half_length_m, half_width_m: distances of the four feet from the middle of the body.
        height_m: height of the body.
        mass_kg: mass of the body.
    """

    half_length_m: float
    half_width_m: float
    height_m: float
    mass_kg: float


def render_model(composition: Composition) -> tuple[mujoco.MjModel, GeomClasses]:
    """Compiles the render model of a world, which has no collision geoms; actors are mocap bodies.

    Args:
        composition: the composed world.

    Returns:
        The model, and the labels of its geoms.

    Raises:
        TownError: MuJoCo cannot compile the model, a visible geom has no label, or a texture would crash Filament.
    """
    tree = copy.deepcopy(composition.tree)
    for parent, geom in _geoms(tree, collision=True):
        parent.remove(geom)
    with _naming_the_file(composition):
        spec = _read(composition, tree, composition.assets)
        model = spec.compile()
    reject_fatal_textures(model, composition.town)
    return model, classify(spec, composition.town)


def placement_spec(composition: Composition) -> mujoco.MjSpec:
    """Reads the spec of the placement model, which has only collision geoms; every actor is a free body on four
    feet.

    Sizes and masses of the actors are missing, because they are measured on the render model; `placement_model` sets
    them later. This function can therefore run while the render model is compiled.

    Args:
        composition: the composed world.

    Raises:
        TownError: MuJoCo cannot read the MJCF, a collision geom is not a primitive, or an actor has no collision geom.
    """
    tree = copy.deepcopy(composition.tree)
    for section in list(tree):
        if section.tag not in _PLACEMENT_SECTIONS:
            tree.remove(section)
    for default in tree.iter("default"):
        for geom in default.findall("geom"):
            for reference in _ASSET_REFERENCES:
                geom.attrib.pop(reference, None)
    for parent, geom in _geoms(tree, collision=False):
        parent.remove(geom)
    worldbody = tree.find("worldbody")
    assert worldbody is not None  # dm_control always writes one
    for light in list(worldbody.findall("light")):
        worldbody.remove(light)
    paths = _files_of_bodies(composition)
    actors = {slot.body for slot in composition.slots}
    for element in worldbody:
        for geom in element.iter("geom"):
            if "mesh" in geom.attrib or "hfield" in geom.attrib:
                path = paths.get(element.get("name", ""), composition.town)
                raise TownError(path, f"collision geom {geom.get('name')!r} must be a primitive")
            geom.attrib.pop("material", None)
        if element.get("name") in actors and element.tag == "body":
            if next(element.iter("geom"), None) is None:
                raise TownError(
                    paths[element.get("name", "")], "has no geom of class collision, so everything could stand in it"
                )
            _free(element)
        else:
            for geom in element.iter("geom"):
                _fix(geom)
    with _naming_the_file(composition):
        return _read(composition, tree, {})


def placement_model(
    composition: Composition, spec: mujoco.MjSpec, placement_bodies: Mapping[str, PlacementBody]
) -> mujoco.MjModel:
    """Compiles the placement model of a world, in which only collisions and rays are computed.

    Args:
        composition: the composed world.
        spec: result of `placement_spec` for that world; changed in place.
        placement_bodies: sizes and masses of the actors, by body name.

    Raises:
        TownError: MuJoCo cannot compile the model.
    """
    for name, placement_body in placement_bodies.items():
        _set_placement_body(spec, name, placement_body)
    with _naming_the_file(composition):
        return spec.compile()


def _files_of_bodies(composition: Composition) -> dict[str, Path]:
    """The MJCF file of each body that gear adds to the town, by the body's name."""
    files = {file.stem: file for file in composition.files[1:]}
    boards = {face.owner: files[face.asset] for face in composition.faces}
    return boards | {slot.body: slot.actor.path for slot in composition.slots}


def _geoms(tree: ET.Element, *, collision: bool) -> list[tuple[ET.Element, ET.Element]]:
    """(parent, geom) for the collision geoms of the worldbody, or for all other geoms."""
    found: list[tuple[ET.Element, ET.Element]] = []

    def walk(parent: ET.Element, inherited: str) -> None:
        inherited = parent.get("childclass", inherited)
        for child in parent:
            if child.tag == "geom":
                name = unprefixed_class(child.get("class", inherited))
                if (name.partition(".")[0] == COLLISION_CLASS) == collision:
                    found.append((parent, child))
            elif child.tag in ("body", "frame"):
                walk(child, inherited)

    for worldbody in tree.iter("worldbody"):
        walk(worldbody, "")
    return found


def _fix(geom: ET.Element) -> None:
    """Sets the group and the contact bits of a collision geom of the town."""
    is_ground = geom.get("name", "").rpartition("/")[2].startswith(GROUND_PREFIX)
    geom.set("group", str(GROUND_GROUP if is_ground else OBSTACLE_GROUP))
    geom.set("contype", "0" if is_ground else _BODIES)
    geom.set("conaffinity", _FEET if is_ground else _BODIES)
    geom.set("rgba", _OPAQUE)


def _free(body: ET.Element) -> None:
    """Makes an actor a free body with feet and inertia; `_set_placement_body` sets their sizes."""
    body.attrib.pop("mocap")
    name = body.get("name", "")
    for geom in body.iter("geom"):
        geom.attrib.update(group=str(ACTOR_GROUP), contype=_BODIES, conaffinity=_BODIES, mass="0", rgba=_OPAQUE)
    body.insert(0, ET.Element("freejoint", name=name))
    ET.SubElement(body, "inertial", pos="0 0 0", mass="1", diaginertia="1 1 1")
    for number in range(len(_CORNERS)):
        ET.SubElement(
            body,
            "geom",
            name=f"{name}_foot_{number}",
            type="sphere",
            size=f"{FOOT_RADIUS_M}",
            mass="0",
            group=str(FOOT_GROUP),
            contype=_FEET,
            conaffinity="0",
            friction="1.5 0.01 0.001",
        )


def _set_placement_body(spec: mujoco.MjSpec, name: str, placement_body: PlacementBody) -> None:
    """Sets mass, inertia and feet of an actor.

    The numbers are rounded, so that actors settle at the same poses if the last digits of the measured sizes change.
    """
    body = spec.body(name)
    x, y, z = 2 * placement_body.half_length_m, 2 * placement_body.half_width_m, placement_body.height_m
    body.mass, body.ipos = _rounded(placement_body.mass_kg, 6), [0, 0, _rounded(0.4 * z, 6)]
    body.inertia = [_rounded(placement_body.mass_kg / 12 * (a * a + b * b), 9) for a, b in ((y, z), (x, z), (x, y))]
    # The feet are its last geoms. Finding them by name would search all geoms in front of them.
    for foot, (sx, sy) in zip(body.geoms[-len(_CORNERS) :], _CORNERS, strict=True):
        place = sx * placement_body.half_length_m, sy * placement_body.half_width_m, FOOT_RADIUS_M
        foot.pos = [_rounded(along, 9) for along in place]


def _rounded(number: float, digits: int) -> float:
    return float(f"{number:.{digits}g}")


def _read(composition: Composition, tree: ET.Element, assets: Mapping[str, bytes]) -> mujoco.MjSpec:
    spec = mujoco.MjSpec.from_string(ET.tostring(tree, encoding="unicode"), assets=dict(assets))
    if composition.folder is not None:
        spec.meshdir = spec.texturedir = str(composition.folder)
    # Either setting would remove bodies and geoms that are looked up by name.
    spec.compiler.discardvisual = spec.compiler.fusestatic = False
    accept_flat_bodies(spec)
    return spec


@contextlib.contextmanager
def _naming_the_file(composition: Composition) -> Iterator[None]:
    """Context that converts errors of MuJoCo to errors that name the file."""
    try:
        yield
    except ValueError as error:
        raise compile_error(error, composition.files) from error
