"""Whether networks, defenses and the attack of a bench are there and suit each other: before anything is rendered."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from gear.config.nodes import Node
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.specs import AttackSpec, DefenseSpec, Kind, ModelSpec, TaskSpec
from gear.measuring.plugin_selection import Chosen, check_defense, chosen_defense, chosen_model
from gear.plugins.build import NO_OPTIONS, find
from gear.plugins.catalogue import PluginEntry
from gear.values.errors import GearError
from gear.verbs.attack.models import check_attack
from gear.verbs.bench.config import BenchConfig, Contestant, settings_of
from gear.verbs.bench.scenes import located


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Entrant:
    """A network or a defense.

    Attributes:
        label: what tables and folders call it.
        plugin: name of the plugin.
        settings: `KEY=VALUE` texts for its options.
        chosen: both, looked up.
    """

    label: str
    plugin: str
    settings: tuple[str, ...]
    chosen: Chosen

    @property
    def learns(self) -> bool:
        """Whether it is a defense that must be calibrated."""
        spec = self.chosen.found.spec
        return isinstance(spec, DefenseSpec) and spec.needs_calibration

    def is_looked_through(self, attack: AttackSpec[object]) -> bool:
        """Whether it is a defense that changes pictures and through which the attack can make patches."""
        spec = self.chosen.found.spec
        if not isinstance(spec, DefenseSpec) or "images" not in spec.outputs:
            return False
        return not attack.needs_gradients or spec.gradient != "none"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Contest:
    """One task's networks and defenses.

    Attributes:
        name: of the task plugin, as the config has it.
        task: its spec.
        models, defenses: in the config's order.
    """

    name: str
    task: TaskSpec[object]
    models: tuple[Entrant, ...]
    defenses: tuple[Entrant, ...]

    @property
    def folder(self) -> str:
        """Of everything that is of this task."""
        return self.name.replace("/", "-")

    @property
    def guards(self) -> tuple[Entrant | None, ...]:
        """None, for networks alone, and every defense."""
        return (None, *self.defenses)


def find_attack(config: BenchConfig, node: Node) -> PluginEntry:
    """The plugin that makes the patches.

    Raises:
        ConfigError: there is none of that name, or an option does not fit.
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


def contests(
    config: BenchConfig, node: Node, *, attack: PluginEntry, surfaces: int, device: str | None = None
) -> Iterator[Contest]:
    """What meets what, in every task.

    Args:
        config: of the bench.
        node: its file, for places in errors.
        attack: that makes the patches.
        surfaces: most that a scene has.
        device: where networks run, as their option `device`; None leaves it to them.

    Raises:
        ConfigError: a plugin is not there, an option is not known, a pair does not suit, or a defense must learn and
            there is no scene for that.
    """
    for name, bench in config.tasks.items():
        try:
            task = find("task", name).spec
        except GearError as error:
            raise located(node, error, "tasks", name) from error
        assert isinstance(task, TaskSpec)
        models = _entrants("model", bench.models, node, ("tasks", name, "models"), device)
        defenses = _entrants("defense", bench.defenses, node, ("tasks", name, "defenses"), None)
        one = Contest(name=name, task=task, models=models, defenses=defenses)
        _check(one, attack, config, node, surfaces)
        yield one


def _entrants(
    kind: Kind, named: Mapping[str, Contestant], node: Node, at: tuple[str, ...], device: str | None
) -> tuple[Entrant, ...]:
    found = []
    for label, one in named.items():
        plugin, settings = one.plugin or label, tuple(settings_of(one.set))
        try:
            if device is not None and hasattr(find(kind, plugin).spec.config(), "device"):
                settings = (*settings, f"device={device}")
            chosen = chosen_model(plugin, settings) if kind == "model" else chosen_defense(plugin, settings)
        except GearError as error:
            raise located(node, error, *at, label) from error
        assert chosen is not None
        found.append(Entrant(label=label, plugin=plugin, settings=settings, chosen=chosen))
    return tuple(found)


def _check(one: Contest, attack: PluginEntry, config: BenchConfig, node: Node, surfaces: int) -> None:
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
        if defense.learns and config.calibration is None:
            problem = (
                "must learn first: name a scene that is not measured in, such as "
                "`calibration: {town: town10, scene: billboard03}`"
            )
            raise located(node, GearError(problem), *at, "defenses", defense.label)
