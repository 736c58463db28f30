"""The reference page of hooks, specs, protocols and the built-in plugins, made from the code."""

from __future__ import annotations

import dataclasses
import inspect
from typing import Any

from gear.contracts import attacks, controllers, defenses, hookspecs, loggers, models, specs, tasks
from gear.plugins.describe import meanings_of, options
from gear.plugins.manager import discover

SPECS = (
    specs.Spec, specs.TaskSpec, specs.ModelSpec, specs.AttackSpec, specs.DefenseSpec, specs.ControllerSpec,
    specs.MetricSpec, specs.LoggerSpec,
)  # fmt: skip
PROTOCOLS = (
    tasks.Task, tasks.Evaluator, models.Model, attacks.Attack, attacks.Compositor, attacks.Objective,
    attacks.HarmObjective, attacks.WithObjective, attacks.WithTaskOptions, attacks.WithInputFiles, models.Trainable,
    models.BatchPredictor, defenses.Defense, defenses.FittedDefense, defenses.FitsInPhases,
    defenses.DifferentiableDetector, defenses.ReportsFit, controllers.Controller, loggers.Logger, loggers.RunLogger,
)  # fmt: skip
VALUES = (
    tasks.Sample, tasks.SplitInfo, tasks.Encoded, tasks.Sidecar, attacks.Patch, attacks.Budget, defenses.DefenseResult,
    defenses.DefendedBatch, defenses.FitReport, controllers.Observation, controllers.Action, controllers.EgoState,
    controllers.CarFacts, controllers.Obstacle, loggers.LoggedRun,
)  # fmt: skip


def page() -> str:
    """The whole page."""
    parts = [
        "# Plugins: hooks, specs, protocols, options",
        f"Protocol version: {specs.PROTOCOL_VERSION}. Entry-point group: `gear`. `gear plugins show NAME` prints the "
        "same facts about one plugin.",
        "## Hooks",
        *(hook(name) for name in sorted(vars(hookspecs)) if name.startswith("gear_")),
        "## Specs and their capabilities",
        *(table(kind) for kind in SPECS),
        "## Protocols",
        *(protocol(kind) for kind in PROTOCOLS),
        "## Values",
        *(table(kind) for kind in VALUES),
        "## Built-in plugins",
        *builtins(),
    ]
    return "\n\n".join(parts) + "\n"


def hook(name: str) -> str:
    """One hook."""
    function = getattr(hookspecs, name)
    return f"- `{name}{signature(function)}`: {first_line(function)}"


def table(kind: type[Any]) -> str:
    """Fields of a dataclass with their meaning."""
    meanings = meanings_of(kind)
    own = [field for field in dataclasses.fields(kind) if field.name in kind.__annotations__]
    rows = [f"| `{f.name}` | `{str(f.type).replace('|', chr(92) + '|')}` | {default(f)} | {meanings.get(f.name, '')} |"
            for f in own]  # fmt: skip
    head = f"### {kind.__name__}\n\n{first_line(kind)}\n"
    return "\n".join([head, "| field | type | default | meaning |", "|---|---|---|---|", *rows])


def default(field: dataclasses.Field[Any]) -> str:
    """A field's default."""
    if field.default is not dataclasses.MISSING:
        value = sorted(field.default) if isinstance(field.default, frozenset) else field.default
        return f"`{value!r}`"
    return "required" if field.default_factory is dataclasses.MISSING else "made anew"


def protocol(kind: type[Any]) -> str:
    """Methods of a protocol."""
    lines = [f"### {kind.__name__}\n\n{first_line(kind)}\n"]
    for name, member in vars(kind).items():
        if inspect.isfunction(member) and not name.startswith("_"):
            text = " ".join((inspect.getdoc(member) or "").split())
            lines.append(f"- `{name}{signature(member)}`: {text}")
    return "\n".join(lines)


def builtins() -> list[str]:
    """gear's own plugins with their options."""
    lines = []
    for found in discover([]).found:
        rows = [f"| `{o['name']}` | `{o['type'].replace('|', chr(92) + '|')}` | `{o['default']}` | {o['meaning']} |"
                for o in options(found.spec.config)]  # fmt: skip
        head = f"### {found.kind} `{found.spec.name}`\n\n{found.spec.summary}\n"
        lines.append("\n".join([head, "| option | type | default | meaning |", "|---|---|---|---|", *rows]))
    return lines


def signature(function: Any) -> str:
    """A signature without `self`, as it is written."""
    shown = inspect.signature(function)
    kept = [p for p in shown.parameters.values() if p.name != "self"]
    return str(shown.replace(parameters=kept)).replace("'", "")


def first_line(thing: Any) -> str:
    """The first line of a docstring."""
    return (inspect.getdoc(thing) or "").splitlines()[0]
