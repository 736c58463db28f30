"""The bench config: which networks and defenses are compared, in which scenes, and against which patches."""

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
from gear.values.serial import Json
from gear.values.setting import Setting

LABEL = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")

WORD = re.compile(r"[-+]?[\w./](?:[\w./+=, -]*[\w./+=,-])?")
"""Pattern of values that need no quotes in YAML, such as numbers, names and paths; `null` also matches."""

TAKEN = frozenset(CONTROLS)
"""Names that networks must not have: `none` and `random` already name the pictures without and with a random patch."""

MOST_SAMPLES = 100_000

MOST_VALUES = 100
"""Largest number of values, and of seeds, of a sweep."""


def _nothing() -> Node:
    return MappingNode({}, Place("defaults"))


@dataclass(frozen=True, slots=True, kw_only=True)
class PluginConfig:
    """A network or a defense of the benchmark, with its options; its key in the bench config is its name in
    tables.

    Attributes:
        plugin: name of the plugin; by default the name in the bench config.
        set: options of the plugin, such as `weights`; `gear plugins show NAME` lists them.
    """

    plugin: str = ""
    set: Node = field(default_factory=_nothing)


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskBench:
    """The networks and defenses that are compared in one task.

    Attributes:
        models: networks, by their names in the tables.
        defenses: defenses by name; each guards every network, and every network is also measured without a defense.
        collect: further collection settings for this task's pictures.
    """

    models: dict[str, PluginConfig]
    defenses: dict[str, PluginConfig] = field(default_factory=dict)
    collect: Node = field(default_factory=_nothing)

    def __post_init__(self) -> None:
        if not self.models:
            raise FieldError("models", "names no network; say one, such as `ddrnet23_slim: {}` (see: gear models)")
        for name in ("models", "defenses"):
            for label in getattr(self, name):
                if not LABEL.fullmatch(label):
                    raise FieldError(name, f"{label!r} names folders and rows: letters, digits, `_`, `.` and `-`")
        for label in TAKEN & self.models.keys():
            raise FieldError("models", f"{label!r} is a reserved name; choose another")


@dataclass(frozen=True, slots=True, kw_only=True)
class Samples:
    """Number of pictures of each scene in each weather, by purpose.

    Attributes:
        attack: number of pictures on which patches are optimised.
        choose: number of pictures on which the best step of an attack is chosen.
        measure: number of pictures on which networks are measured: without a patch, with a random patch, and with each
            optimised patch.
        calibrate: number of pictures on which defenses are calibrated.
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
    """The attack that makes the patches of the benchmark.

    Attributes:
        plugin: name of the attack plugin.
        steps: number of optimisation steps.
        queries: number of forward passes for attacks without gradients; 0 for attacks with gradients.
        compositor: method that puts patches into pictures: `transport` (exact), or `homography`, which needs no probes.
        patches: source of patches that exist already and are used in place of this attack: `shipped` for those of the
            installed weights packages, or the folder of another benchmark; empty for none. Patches that the source
            does not have are made by the attack.
        set: options of the attack (`gear plugins show ATTACK` lists them).
    """

    plugin: str = "scene_specific"
    steps: int = 120
    queries: int = 0
    compositor: Literal["transport", "homography"] = "transport"
    patches: str = ""
    set: Node = field(default_factory=_nothing)

    def __post_init__(self) -> None:
        if self.steps < 1:
            raise FieldError("steps", f"must be at least 1, got {self.steps}")
        if self.queries < 0:
            raise FieldError("queries", f"must not be negative, got {self.queries}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibration:
    """The scene in which defenses are calibrated; it must not be one of the measured scenes.

    Attributes:
        town: name of the town of this scene.
        scene: name of the scene.
    """

    town: str
    scene: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Sweep:
    """A key of the config that takes several values, one benchmark for each; `gear bench` plots the results.

    Attributes:
        key: name of the key, such as `samples.attack`.
        values: values as YAML texts, such as `24` or `[ClearNoon]`.
        seeds: number of benchmarks for each value, with the seeds `seed`, `seed + 1`, and so on.
        title: title of the axis; by default the key.
    """

    key: str
    values: tuple[str, ...]
    seeds: int = 1
    title: str = ""

    def __post_init__(self) -> None:
        if not self.values or len(self.values) > MOST_VALUES:
            raise FieldError("values", f"must be 1 to {MOST_VALUES} values, got {len(self.values)}")
        if not 1 <= self.seeds <= MOST_VALUES:
            raise FieldError("seeds", f"must be 1 to {MOST_VALUES}, got {self.seeds}")
        if self.key.partition(".")[0] in ("sweep", "seed", ""):
            raise FieldError("key", f"{self.key!r} cannot be swept; name another key, such as samples.attack")


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveBench:
    """The drives of the benchmark in the closed loop (`gear drive`): every network, alone and behind each defense,
    drives through scenarios in every scene and weather, without a patch, with a random patch, and with the optimised
    patches.

    Attributes:
        controllers: name of the controller plugin, by task; by default `<task>_baseline`.
        references: controllers without a network that drive as well, such as `truth` and `blind`.
        scenarios: speeds of the ego car in km/h, by name of the scenario; an empty list means the speeds of the
            library. Empty for all scenarios of the library.
        library: name or path of the library of scenarios.
        repeats: number of drives of each situation, with different seeds.
        crowd: factor on the scene's numbers of other vehicles and people, 0 to 10.
        video: whether each drive leaves a video (MP4), which needs the extra `video`.
        open_loop: whether the predictions of each drive are also evaluated by the metrics of their task.
    """

    controllers: dict[str, str] = field(default_factory=dict)
    references: tuple[str, ...] = ()
    scenarios: dict[str, tuple[float, ...]] = field(default_factory=dict)
    library: str = "standard"
    repeats: int = 1
    crowd: float = 0.5
    video: bool = False
    open_loop: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchConfig:
    """The configuration of a whole benchmark.

    Attributes:
        tasks: networks and defenses to compare, by name of the task plugin.
        places: names of scenes, by town; an empty list means every scene of the town that has a surface for patches.
        weathers: weather presets, or presets with changed fields; one patch is optimised for all weathers together.
        samples: number of pictures of each scene in each weather.
        attack: the attack that makes the patches.
        calibration: scene in which defenses are calibrated; needed if a defense requires calibration.
        transfer: whether each network is also measured with the patches that were optimised against the other networks.
        adaptive: whether patches are also optimised against each network behind each defense that supports this attack.
        seed: seed of all random draws.
        collect: further collection settings for all tasks (`gear show-config` prints the keys).
        sweep: a key that takes several values; None for a single benchmark.
        drives: drives in the closed loop; None for none.
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
    sweep: Sweep | None = None
    drives: DriveBench | None = None

    def __post_init__(self) -> None:
        for name, what in (("tasks", "task"), ("places", "town"), ("weathers", "weather")):
            if not getattr(self, name):
                raise FieldError(name, f"names no {what}")
        if self.seed < 0:
            raise FieldError("seed", f"must not be negative, got {self.seed}")


def settings_of(node: Node, above: str = "") -> Iterable[Setting]:
    """Yields nested options as flat `KEY=VALUE` texts, one per option, such as `augmentation.flip=0`. Errors name
    them as YAML.

    Args:
        node: the nested options.
        above: name of the option that contains them; "" at the top.
    """
    if isinstance(node, MappingNode) and (node.entries or not above):
        for key, (_, below) in node.entries.items():
            yield from settings_of(below, f"{above}.{key}" if above else key)
    elif not isinstance(node, Scalar):
        yield _setting(above, flow_text(node_to_json(node)))
    elif above:
        yield _setting(above, _quoted(node))


def _setting(key: str, value: str) -> Setting:
    return Setting(f"{key}={value}", given=f"`{key}: {value}`")


def flow_text(value: Json) -> str:
    """Returns a value as one line of YAML in flow style, such as `{speeds: [20, 40]}`."""
    text: str = yaml.safe_dump(value, default_flow_style=True, allow_unicode=True, width=1 << 20)
    return text.removesuffix("\n...\n").strip()


def _quoted(node: Scalar) -> str:
    """Returns the text of a value, quoted where YAML would otherwise read another value."""
    if node.is_null:
        return ""
    is_word = WORD.fullmatch(node.text) and node.text.casefold() != "null"
    return node.text if is_word else "'" + node.text.replace("'", "''") + "'"
