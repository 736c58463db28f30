"""The bench config: which networks and defenses, in which scenes, against which patches."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

import yaml

from gear.config.collection import WeatherConfig
from gear.config.dump import node_to_json
from gear.config.nodes import Mapping as MappingNode
from gear.config.nodes import Node, Place, Scalar
from gear.contracts.tasks import CONTROLS
from gear.values.errors import FieldError

LABEL = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")

WORD = re.compile(r"[-+]?[\w./](?:[\w./+=, -]*[\w./+=,-])?")
"""Texts that are the same to YAML without quotes, null apart: numbers, names and paths above all."""

TAKEN = frozenset(CONTROLS)
"""Kinds of pictures: those with a network's patch have the network's name."""

MOST_SAMPLES = 100_000


def _nothing() -> Node:
    return MappingNode({}, Place("defaults"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Contestant:
    """A network or a defense under a name of its own.

    Attributes:
        plugin: name of the plugin; the contestant's own name unless given.
        set: its options (`gear plugins show NAME`), `weights` above all.
    """

    plugin: str = ""
    set: Node = field(default_factory=_nothing)


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskBench:
    """What is compared in one task.

    Attributes:
        models: networks, by the names that tables give them.
        defenses: that stand before each of them, by name; every network is measured without any, too.
        collect: further keys of this task's collections.
    """

    models: dict[str, Contestant]
    defenses: dict[str, Contestant] = field(default_factory=dict)
    collect: Node = field(default_factory=_nothing)

    def __post_init__(self) -> None:
        if not self.models:
            raise FieldError("models", "names no network; say one, such as `ddrnet23_slim: {}` (see: gear models)")
        for name in ("models", "defenses"):
            for label in getattr(self, name):
                if not LABEL.fullmatch(label):
                    raise FieldError(name, f"{label!r} names folders and rows: letters, digits, `_`, `.` and `-`")
        for label in TAKEN & self.models.keys():
            raise FieldError("models", f"{label!r} is what pictures without the network's patch are called")


@dataclass(frozen=True, slots=True, kw_only=True)
class Samples:
    """Pictures of each scene in each weather.

    Attributes:
        attack: that patches are made on.
        choose: that choose among an attack's steps.
        measure: that networks are measured on: without a patch, with a random one, with each patch that was made.
        calibrate: that defenses learn from.
    """

    attack: int = 24
    choose: int = 4
    measure: int = 24
    calibrate: int = 24

    def __post_init__(self) -> None:
        for name in ("attack", "choose", "measure", "calibrate"):
            if not 1 <= getattr(self, name) <= MOST_SAMPLES:
                raise FieldError(name, f"must be 1 to {MOST_SAMPLES}, got {getattr(self, name)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class AttackBench:
    """How patches are made.

    Attributes:
        plugin: name of an attack plugin.
        steps: of optimisation.
        queries: forward passes, for attacks without gradients; 0 for those with.
        compositor: `transport` (exact) or `homography`.
        set: the attack's options.
    """

    plugin: str = "scene_specific"
    steps: int = 120
    queries: int = 0
    compositor: Literal["transport", "homography"] = "transport"
    set: Node = field(default_factory=_nothing)

    def __post_init__(self) -> None:
        if self.steps < 1:
            raise FieldError("steps", f"must be at least 1, got {self.steps}")
        if self.queries < 0:
            raise FieldError("queries", f"must not be negative, got {self.queries}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """The scene that defenses learn from; none that is measured.

    Attributes:
        town: where it is.
        scene: its name.
    """

    town: str
    scene: str


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchConfig:
    """One bench.

    Attributes:
        tasks: by name of the task plugin.
        places: scenes by town; an empty list is every scene of the town that has a surface for patches.
        weathers: presets, or presets and what differs; a patch is made for all of them.
        samples: how many pictures of each scene in each weather.
        attack: how patches are made.
        calibration: where defenses learn; needed if one of them must.
        transfer: whether each network also sees the patches that were made against the others.
        adaptive: whether patches are also made through every defense that an attack can look through.
        seed: of everything that is drawn.
        collect: further keys of the collections of all tasks (`gear show-config` prints them).
    """

    tasks: dict[str, TaskBench]
    places: dict[str, tuple[str, ...]]
    weathers: tuple[WeatherConfig, ...] = (WeatherConfig(),)
    samples: Samples = field(default_factory=Samples)
    attack: AttackBench = field(default_factory=AttackBench)
    calibration: Calibration | None = None
    transfer: bool = False
    adaptive: bool = False
    seed: int = 0
    collect: Node = field(default_factory=_nothing)

    def __post_init__(self) -> None:
        for name, what in (("tasks", "task"), ("places", "town"), ("weathers", "weather")):
            if not getattr(self, name):
                raise FieldError(name, f"names no {what}")
        if self.seed < 0:
            raise FieldError("seed", f"must not be negative, got {self.seed}")


def settings_of(node: Node, above: str = "") -> Iterable[str]:
    """A tree of options as the `KEY=VALUE` texts that set them one by one."""
    if isinstance(node, MappingNode) and (node.entries or not above):
        for key, (_, below) in node.entries.items():
            yield from settings_of(below, f"{above}.{key}" if above else key)
    elif not isinstance(node, Scalar):
        flow = yaml.safe_dump(node_to_json(node), default_flow_style=True, allow_unicode=True, width=1 << 20)
        yield f"{above}={flow.strip()}"
    elif above:
        yield f"{above}={_quoted(node)}"


def _quoted(node: Scalar) -> str:
    """So that it is read as the same text again."""
    if node.is_null:
        return ""
    is_word = WORD.fullmatch(node.text) and node.text.casefold() != "null"
    return node.text if is_word else "'" + node.text.replace("'", "''") + "'"
