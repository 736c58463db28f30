"""Checks, before anything is rendered, that the networks, defenses and the attack of a benchmark exist and fit
together.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from gear.config.load import load_collection
from gear.config.nodes import Node
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.defenses import DifferentiableDetector
from gear.contracts.specs import AttackSpec, DefenseSpec, Kind, ModelSpec, TaskSpec
from gear.measuring.plugin_selection import Chosen, check_defense, chosen_defense, chosen_model
from gear.plugins.build import NO_OPTIONS, build, find
from gear.plugins.catalogue import PluginEntry
from gear.values.errors import GearError
from gear.values.setting import Setting
from gear.verbs.attack.models import check_attack
from gear.verbs.bench.config import BenchConfig, PluginConfig, settings_of
from gear.verbs.bench.scenes import located

DECIDED = {
    "task": "tasks",
    "town": "places",
    "scene": "places",
    "scenes": "places",
    "weather": "weathers",
    "samples": "samples",
    "seed": "seed",
    "split": "",
    "root": "",
    "patch": "",
    "patch_seed": "",
    "probes": "",
}
"""Keys of a collection that a benchmark decides, each with the key of the bench config that decides it; empty where the
benchmark alone does."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Candidate:
    """A network or a defense of the benchmark, with its plugin.

    Attributes:
        label: name in tables and folders.
        plugin: name of the plugin.
        settings: `KEY=VALUE` texts for the plugin's options.
        chosen: the plugin object with its options.
    """

    label: str
    plugin: str
    settings: tuple[str, ...]
    chosen: Chosen

    @property
    def needs_calibration(self) -> bool:
        """Whether this is a defense that needs calibration; False for a network."""
        spec = self.chosen.found.spec
        return isinstance(spec, DefenseSpec) and spec.needs_calibration

    @property
    def changes_pictures(self) -> bool:
        """Whether this is a defense that returns other pictures; some defenses only detect patches. False for a
        network.
        """
        spec = self.chosen.found.spec
        return isinstance(spec, DefenseSpec) and "images" in spec.outputs

    def supports_adaptive_attack(self, attack: AttackSpec[object]) -> bool:
        """Whether this is a defense that the attack can take into account, so patches can be optimised against it.
        False for a network.

        An attack with gradients needs a defense that passes gradients. A defense that leaves the pictures unchanged can
        be taken into account only by its differentiable score or mask.

        Args:
            attack: spec of the attack.
        """
        spec = self.chosen.found.spec
        if not isinstance(spec, DefenseSpec):
            return False
        if self.changes_pictures:
            return not attack.needs_gradients or spec.gradient != "none"
        if spec.gradient == "none" or not attack.needs_gradients:
            return False
        return isinstance(build(self.chosen.found, self.chosen.options), DifferentiableDetector)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TaskPlugins:
    """The networks and defenses of one task.

    Attributes:
        name: name of the task plugin in the config.
        task: spec of the task.
        models, defenses: networks and defenses in the order of the config.
    """

    name: str
    task: TaskSpec[object]
    models: tuple[Candidate, ...]
    defenses: tuple[Candidate, ...]

    @property
    def folder(self) -> str:
        """Name of the subfolder for the results of this task."""
        return self.name.replace("/", "-")

    @property
    def guards(self) -> tuple[Candidate | None, ...]:
        """None, which stands for the networks alone, followed by every defense."""
        return (None, *self.defenses)


def find_attack(config: BenchConfig, node: Node) -> PluginEntry:
    """Returns the attack plugin that makes the patches.

    Args:
        config: config of the benchmark.
        node: the same config as a YAML tree, for the position in messages.

    Raises:
        ConfigError: there is no plugin of that name, or an option does not fit.
    """
    try:
        found = find("attack", config.attack.plugin)
    except GearError as error:
        raise located(node, error, "attack", "plugin") from error
    try:
        read_node(found.spec.config, with_overrides(NO_OPTIONS, settings_of(config.attack.set)), "")
    except GearError as error:
        raise located(node, error, "attack", "set") from error
    return found


def plugins_of_tasks(
    config: BenchConfig, node: Node, *, attack: PluginEntry, surfaces: int, device: str | None = None
) -> Iterator[TaskPlugins]:
    """Yields the networks and defenses of every task, checked against each other.

    Args:
        config: the bench config.
        node: YAML tree of the config, for positions in error messages.
        attack: plugin that makes the patches.
        surfaces: largest number of surfaces in a scene.
        device: value for the networks' option `device`; None keeps the value of the config.

    Raises:
        ConfigError: a plugin does not exist, an option is unknown, a network and a defense do not fit, or a defense
            needs calibration and the config names no calibration scene.
    """
    for name, bench in config.tasks.items():
        try:
            task = find("task", name).spec
        except GearError as error:
            raise located(node, error, "tasks", name) from error
        assert isinstance(task, TaskSpec)
        models = _entrants("model", bench.models, node, ("tasks", name, "models"), device)
        defenses = _entrants("defense", bench.defenses, node, ("tasks", name, "defenses"), None)
        one = TaskPlugins(name=name, task=task, models=models, defenses=defenses)
        _check(one, attack, config, node, surfaces)
        yield one


def _entrants(
    kind: Kind, named: Mapping[str, PluginConfig], node: Node, at: tuple[str, ...], device: str | None
) -> tuple[Candidate, ...]:
    found = []
    for label, one in named.items():
        plugin, settings = one.plugin or label, tuple(settings_of(one.set))
        try:
            if device is not None and hasattr(find(kind, plugin).spec.config(), "device"):
                settings = (*settings, Setting(f"device={device}", given=f"--device {device}"))
            chosen = chosen_model(plugin, settings) if kind == "model" else chosen_defense(plugin, settings)
        except GearError as error:
            raise located(node, error, *at, label) from error
        assert chosen is not None
        found.append(Candidate(label=label, plugin=plugin, settings=settings, chosen=chosen))
    return tuple(found)


def _check(one: TaskPlugins, attack: PluginEntry, config: BenchConfig, node: Node, surfaces: int) -> None:
    at = ("tasks", one.name)
    for model in one.models:
        spec = model.chosen.found.spec
        assert isinstance(spec, ModelSpec)
        if one.task.name not in spec.tasks:
            problem = f"model {spec.name!r} does {', '.join(spec.tasks)}, not {one.task.name}"
            raise located(node, GearError(problem), *at, "models", model.label)
        missing = [name for name in spec.views if name not in one.task.views]
        if missing:
            problem = f"model {spec.name!r} looks at {', '.join(missing)}, which {one.name} does not have"
            raise located(node, GearError(problem), *at, "models", model.label)
        try:
            check_attack(attack, [model.chosen], one.task.name, surfaces, config.attack.queries or None)
        except GearError as error:
            raise located(node, error, "attack") from error
        for defense in one.defenses:
            try:
                check_defense(defense.chosen, model.chosen, one.task.name, is_calibrated=True)
            except GearError as error:
                raise located(node, error, *at, "defenses", defense.label) from error
    for defense in one.defenses:
        if defense.needs_calibration and config.calibration is None:
            problem = (
                "must learn first: name a scene that is not measured in, such as "
                "`calibration: {town: town10, scene: billboard03}`"
            )
            raise located(node, GearError(problem), *at, "defenses", defense.label)


def check_collect(task: str, settings: Iterable[str]) -> None:
    """Checks that the collection settings of a benchmark leave alone what the benchmark decides, such as the folder of
    the pictures or their seed.

    The parsed config is checked, not the texts, so it does not matter how a key is spelled.

    Args:
        task: name of the task plugin.
        settings: `KEY=VALUE` texts of `collect`.

    Raises:
        GearError: a setting cannot be read, or sets a key that the benchmark decides.
    """
    flag = "task"
    unset = load_collection(None, {flag: task}).places[flag]
    places = load_collection(None, {flag: task}, settings).places
    for key, decided_by in DECIDED.items():
        if key in places and not (key == flag and places[key] == unset):
            instead = f"; it follows from the key {decided_by!r} of the bench config" if decided_by else ""
            raise GearError(f"{key!r} is decided by the benchmark, so collect must not set it{instead}")
