"""Finds MJCF files by name or path. Reads the metadata in the files of actors, such as kind and colours, without
compiling them.
"""

from __future__ import annotations

import os
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal, cast

from gear.values.errors import TownError, UnknownNameError
from gear.values.labels import LABEL_BY_NAME, VEHICLES, Label, VehicleKind
from gear.values.regular_file import check_regular
from gear.values.resources import data_dir
from gear.values.scene import Vec3

Gait = Literal["walk", "stand", ""]

PERSON = "person"
"""Kind of the actors that walk; all other kinds are names in `VEHICLES`."""


MOST_WEIGHT = 1e6
"""Largest weight of an asset or a colour; the limit keeps sums and shares of weights finite."""

KEY_POINT = "key_point."
"""Start of the names of entries in an actor's `<custom>` section that describe a key point."""

MOST_KEY_POINT_M = 100.0

_NAN = re.compile(r"^([-+.\deE\s]*\s)?[-+]?nan(\s|$)", re.IGNORECASE)
"""Regular expression that matches a list of numbers which contains NaN."""

FOLDERS = {"town": "towns", "vehicle": "vehicles", "pedestrian": "pedestrians", "surface": "surfaces"}


def read_xml(path: Path) -> ET.Element:
    """Parses an MJCF file and returns its root element.

    Args:
        path: path of the file.

    Raises:
        TownError: the file is not XML, or cannot be read.
    """
    try:
        return ET.parse(check_regular(path)).getroot()
    except (
        ET.ParseError,
        OSError,
        LookupError,
        ValueError,
    ) as error:  # LookupError and ValueError: an unknown encoding
        raise TownError(path, f"cannot be read as MJCF: {error}") from error


def read_numbers(path: Path) -> ET.Element:
    """Parses an MJCF file, returns its root element, and rejects NaN. MuJoCo only prints a warning for NaN and
    leaves out the geom.

    Args:
        path: path of the file.

    Raises:
        TownError: the file is not XML, cannot be read, or contains a NaN.
    """
    root = read_xml(path)
    for element in root.iter():
        for key, text in element.items():
            if _NAN.search(text):
                raise TownError(path, f"{key} of {element.tag} {element.get('name', '')!r} is no number: {text!r}")
    return root


@dataclass(frozen=True, slots=True, kw_only=True)
class ActorFacts:
    """The metadata in an actor's MJCF file.

    Attributes:
        name: name of the asset: the file's name without suffix.
        path: path of the file.
        kind: `person`, or a name in `VEHICLES`.
        gait: `walk` or `stand` for people, "" for vehicles.
        weight: how often the asset is drawn, relative to the other assets in its folder.
        palette: possible colours of the paint as linear albedo 0..1, each with a weight.
        key_points: named points such as a person's joints, in the actor frame, metres.
    """

    name: str
    path: Path
    kind: str
    gait: Gait
    weight: float
    palette: tuple[tuple[Vec3, float], ...]
    key_points: tuple[tuple[str, Vec3], ...] = ()

    @property
    def label(self) -> Label:
        """The semantic label of the actor's kind."""
        return LABEL_BY_NAME[self.kind]

    @property
    def vehicle(self) -> VehicleKind | None:
        """The kind of the vehicle; None for people."""
        return VEHICLES.get(self.kind)


def read_actor_facts(path: Path) -> ActorFacts:
    """Reads the metadata of an actor from the `<custom>` sections of its MJCF file and of included files.

    Args:
        path: path of the actor's MJCF file.

    Raises:
        TownError: a file is not XML, or an entry breaks gear's conventions for MJCF.
    """
    sections = (custom for root in _with_included(path) for custom in root.iter("custom"))
    entries = {item.get("name", ""): item.get("data", "") for custom in sections for item in custom}
    kind = entries.get("actor.kind", "")
    vehicle = VEHICLES.get(kind)
    if vehicle is None and kind != PERSON:
        raise TownError(path, f"actor.kind must be one of {', '.join([*VEHICLES, PERSON])}, got {kind!r}")
    gait = entries.get("actor.pose", "stand" if kind == PERSON else "")
    if gait not in ("walk", "stand", ""):
        raise TownError(path, f"actor.pose must be walk or stand, got {gait!r}")
    weight = _numbers(path, "actor.weight", entries.get("actor.weight", "1"))
    palette = _numbers(path, "paint.palette", entries.get("paint.palette", ""))
    if len(weight) != 1 or not 0 <= weight[0] <= MOST_WEIGHT:
        raise TownError(
            path,
            f"actor.weight must be one number up to {MOST_WEIGHT:g}, not negative, got {entries['actor.weight']!r}",
        )
    if len(palette) % 4 or not all(0 <= value <= MOST_WEIGHT for value in palette):
        raise TownError(
            path, f"paint.palette must be groups of four: r g b weight, none negative or above {MOST_WEIGHT:g}"
        )
    if max((value for i, value in enumerate(palette) if i % 4 < 3), default=0) > 1:
        raise TownError(path, "paint.palette must be albedo, 0 to 1: r g b weight r g b weight …")
    colours = tuple(((palette[i], palette[i + 1], palette[i + 2]), palette[i + 3]) for i in range(0, len(palette), 4))
    return ActorFacts(
        name=path.stem,
        path=path,
        kind=kind,
        gait=cast(Gait, gait),
        weight=weight[0] * (1.0 if vehicle is None else vehicle.weight),
        palette=colours,
        key_points=_key_points(path, entries),
    )


def _key_points(path: Path, entries: Mapping[str, str]) -> tuple[tuple[str, Vec3], ...]:
    """The named points of an actor, from elements such as `<numeric name="key_point.left_knee" data="0.02 0.09
    0.48"/>`.

    Raises:
        TownError: a point is not three numbers within `MOST_KEY_POINT_M` of the origin.
    """
    points: list[tuple[str, Vec3]] = []
    for entry, text in entries.items():
        name = entry.removeprefix(KEY_POINT)
        if name == entry:
            continue
        numbers = _numbers(path, entry, text)
        if len(numbers) != 3 or not all(abs(value) <= MOST_KEY_POINT_M for value in numbers) or not name:
            raise TownError(path, f"{entry} must be x y z in metres, within {MOST_KEY_POINT_M:g} m, got {text!r}")
        points.append((name, (numbers[0], numbers[1], numbers[2])))
    return tuple(points)


def _with_included(path: Path) -> Iterator[ET.Element]:
    """Yields the root elements of an MJCF file and of the files that it includes.

    Raises:
        TownError: one of the files is not XML, or cannot be read.
    """
    files = [path]
    for file in files:  # the list grows by the files that are included
        root = read_xml(file)
        yield root
        included = [file.parent / name for include in root.iter("include") if (name := include.get("file"))]
        files += [one for one in map(Path, map(os.path.normpath, included)) if one not in files]


def _numbers(path: Path, name: str, text: str) -> tuple[float, ...]:
    try:
        return tuple(float(word) for word in text.split())
    except ValueError as error:
        raise TownError(path, f"{name} must be numbers, got {text!r}") from error


@dataclass(frozen=True)
class AssetLibrary:
    """The MJCF files of one town and of the actors and boards that it uses.

    A town in a folder `towns` may have its own folders `vehicles`, `pedestrians` and `surfaces` next to that folder;
    each of these folders replaces gear's own folder of that name.

    Attributes:
        town: path of the town's MJCF file.
    """

    town: Path

    @staticmethod
    def for_town(town: str | Path) -> AssetLibrary:
        """Makes the asset library of a town, which finds the town's MJCF files.

        Args:
            town: name of a town of gear, or path of an MJCF file with or without the suffix `.xml`.

        Raises:
            UnknownNameError: there is no such town.
        """
        text, towns = str(town), data_dir("mjcf") / "towns"
        is_path = text.endswith(".xml") or "/" in text
        try:
            paths = [Path(text), Path(f"{text}.xml")] if is_path else [towns / f"{text}.xml"]
            found = next((path for path in (path.expanduser() for path in paths) if path.is_file()), None)
        except (OSError, RuntimeError) as error:  # unknown user in `~user`, no permission, or name too long
            problem = getattr(error, "strerror", None) or error
            raise UnknownNameError("town", text, hint=f"(cannot look there: {problem})") from error
        if found is None:
            hint = "(that file does not exist; or give the path of a MJCF that does)" if is_path else ""
            raise UnknownNameError("town", text, _names(towns), hint)
        return AssetLibrary(found.resolve() if is_path else found)

    @property
    def town_name(self) -> str:
        """Name of the town: the name of its file without suffix."""
        return self.town.stem

    def folder(self, kind: Literal["vehicle", "pedestrian", "surface"]) -> Path:
        """The folder with the MJCF files of all vehicles, pedestrians or surfaces.

        Args:
            kind: the kind of asset.

        Returns:
            The town's own folder if it has one next to its folder `towns`, otherwise gear's folder.
        """
        own = self.town.parent.parent / FOLDERS[kind]
        if self.town.parent.name == "towns" and own.is_dir():
            return own
        return data_dir("mjcf") / FOLDERS[kind]

    def path(self, kind: Literal["vehicle", "pedestrian", "surface"], name: str) -> Path:
        """Path of the MJCF file of the asset with this kind and name.

        Args:
            kind: the kind of asset.
            name: name of the asset: its file's name without suffix.

        Raises:
            UnknownNameError: there is no asset with this name.
        """
        folder = self.folder(kind)
        path = folder / f"{name}.xml"
        if Path(name).name != name or not _is_there(path):
            is_own = folder != data_dir("mjcf") / FOLDERS[kind]
            raise UnknownNameError(
                kind, name, _names(folder), f"({folder} takes the place of gear's)" if is_own else ""
            )
        return path

    @cached_property
    def vehicles(self) -> dict[str, ActorFacts]:
        """The metadata of all vehicles by name, in alphabetical order."""
        return self._actors("vehicle")

    @cached_property
    def pedestrians(self) -> dict[str, ActorFacts]:
        """The metadata of all people by name, in alphabetical order."""
        return self._actors("pedestrian")

    def _actors(self, kind: Literal["vehicle", "pedestrian"]) -> dict[str, ActorFacts]:
        folder = self.folder(kind)
        facts = {path.stem: read_actor_facts(path) for path in sorted(folder.glob("*.xml"))}
        if not facts:
            raise TownError(folder, f"holds no {kind}")
        for fact in facts.values():
            if (fact.kind == PERSON) != (kind == "pedestrian"):
                raise TownError(fact.path, f"a {fact.kind} does not belong into {folder.name}")
        return facts


def _is_there(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # the name is too long, or no permission
        return False


def _names(folder: Path) -> list[str]:
    return [path.stem for path in folder.glob("*.xml")]
