"""Finding MJCF by name or by path, and reading what a file says of itself without compiling it."""

from __future__ import annotations

import os
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
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
"""Kind of the actors that walk; every other kind is one of `VEHICLES`."""


MOST_WEIGHT = 1e6
"""Of an asset among others, or of a colour: sums and shares of such are finite."""

_NAN = re.compile(r"^([-+.\deE\s]*\s)?[-+]?nan(\s|$)", re.IGNORECASE)
"""Numbers of which one is none."""

FOLDERS = {"town": "towns", "vehicle": "vehicles", "pedestrian": "pedestrians", "surface": "surfaces"}


def read_xml(path: Path) -> ET.Element:
    """The root of a MJCF file.

    Raises:
        TownError: it is no XML, or cannot be read.
    """
    try:
        return ET.parse(check_regular(path)).getroot()
    except (ET.ParseError, OSError, LookupError, ValueError) as error:  # the latter two: an encoding that nobody knows
        raise TownError(path, f"cannot be read as MJCF: {error}") from error


def read_numbers(path: Path) -> ET.Element:
    """As `read_xml`, for a file whose numbers are used: over a nan MuJoCo only mutters, and what has it is not drawn.

    Raises:
        TownError: it is no XML, cannot be read, or one of its numbers is none.
    """
    root = read_xml(path)
    for element in root.iter():
        for key, text in element.items():
            if _NAN.search(text):
                raise TownError(path, f"{key} of {element.tag} {element.get('name', '')!r} is no number: {text!r}")
    return root


@dataclass(frozen=True, slots=True, kw_only=True)
class ActorFacts:
    """What an actor's file says of itself.

    Attributes:
        name: of the asset: its file's stem.
        path: its MJCF.
        kind: `person`, or a name in `VEHICLES`.
        gait: `walk` or `stand` for people, empty for vehicles.
        weight: how common it is among all assets of its folder.
        palette: linear albedo choices of its paint, with how common each is.
    """

    name: str
    path: Path
    kind: str
    gait: Gait
    weight: float
    palette: tuple[tuple[Vec3, float], ...]

    @property
    def label(self) -> Label:
        """The label of its kind."""
        return LABEL_BY_NAME[self.kind]

    @property
    def vehicle(self) -> VehicleKind | None:
        """Its kind of vehicle; None for people."""
        return VEHICLES.get(self.kind)


def read_actor_facts(path: Path) -> ActorFacts:
    """Reads the `<custom>` sections of an actor's MJCF, those of files that it includes too.

    Raises:
        TownError: it is no MJCF or breaks the conventions.
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
    )


def _with_included(path: Path) -> Iterator[ET.Element]:
    """The roots of a MJCF file and of what it includes.

    Raises:
        TownError: one of them is no XML, or cannot be read.
    """
    files = [path]
    for file in files:  # grows: what is included is looked at in turn
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
    """The MJCF that goes with one town.

    A town inside a folder `towns` may bring its own `vehicles`, `pedestrians` and `surfaces` beside that folder; each
    kind that it brings replaces gear's.

    Attributes:
        town: path of the town's MJCF.
    """

    town: Path

    @staticmethod
    def for_town(town: str | Path) -> AssetLibrary:
        """By a town's name, or by the path of its MJCF, with or without the `.xml` at its end.

        Raises:
            UnknownNameError: there is no such town.
        """
        text, towns = str(town), data_dir("mjcf") / "towns"
        is_path = text.endswith(".xml") or "/" in text
        try:
            paths = [Path(text), Path(f"{text}.xml")] if is_path else [towns / f"{text}.xml"]
            found = next((path for path in (path.expanduser() for path in paths) if path.is_file()), None)
        except (OSError, RuntimeError) as error:  # no such user's home, no permission, too long a name
            problem = getattr(error, "strerror", None) or error
            raise UnknownNameError("town", text, hint=f"(cannot look there: {problem})") from error
        if found is None:
            hint = "(that file does not exist; or give the path of a MJCF that does)" if is_path else ""
            raise UnknownNameError("town", text, _names(towns), hint)
        return AssetLibrary(found.resolve() if is_path else found)

    @property
    def town_name(self) -> str:
        """Name of the town: its file's stem."""
        return self.town.stem

    def folder(self, kind: Literal["vehicle", "pedestrian", "surface"]) -> Path:
        """Where assets of a kind are."""
        own = self.town.parent.parent / FOLDERS[kind]
        if self.town.parent.name == "towns" and own.is_dir():
            return own
        return data_dir("mjcf") / FOLDERS[kind]

    def path(self, kind: Literal["vehicle", "pedestrian", "surface"], name: str) -> Path:
        """An asset's MJCF.

        Raises:
            UnknownNameError: there is none of that name.
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
        """All vehicles by name, in alphabetical order."""
        return self._actors("vehicle")

    @cached_property
    def pedestrians(self) -> dict[str, ActorFacts]:
        """All people on foot by name, in alphabetical order."""
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
    except OSError:  # too long a name, or no permission
        return False


def _names(folder: Path) -> list[str]:
    return [path.stem for path in folder.glob("*.xml")]
