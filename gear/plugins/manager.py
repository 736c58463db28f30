"""Discovery: every plugin is loaded in a guard of its own; a broken one is reported, never fatal, never invisible."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib
import importlib.metadata
import io
import os
import re
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from typing import Any

import pluggy

from gear.contracts import hookspecs
from gear.contracts.models import PublishedWeights, Recipe
from gear.contracts.specs import PROTOCOL_VERSION, SPEC_TYPES, AnySpec, Kind, ModelSpec
from gear.plugins.builtins import BUILTINS
from gear.plugins.catalogue import Broken, Catalogue, Owner, PluginEntry, as_iterable, one_line

GROUP = "gear"
HOOK_OF: dict[Kind, str] = {
    "task": "gear_tasks",
    "model": "gear_models",
    "attack": "gear_attacks",
    "defense": "gear_defenses",
}
CAPABILITY_TYPES: dict[str, type] = {
    "tasks": tuple,
    "views": tuple,
    "taps": tuple,
    "outputs": frozenset,
    "layout": str,
    "gradient": str,
    "has_gradients": bool,
    "needs_gradients": bool,
    "needs_calibration": bool,
    "needs_model": bool,
    "normalisation": str,
    "parameters": int,
    "input_scale": float,
    "needs": tuple,
    "published": tuple,
    "starts": Mapping,
    "original_name": str,
    "figure": str,
    "less_is_better": bool,
    "needs_probes": bool,
    "max_surfaces": int,
    "is_control": bool,
}
ITEM_TYPES: dict[str, type] = {"published": PublishedWeights}
"""Of what does not hold names."""

NAME = re.compile(r"[a-z][a-z0-9_]*")
DISTRIBUTION = "mujoco-gear"


@cache
def catalogue() -> Catalogue:
    """All plugins of this environment, found once a process.

    `GEAR_DISABLE_PLUGINS` (names joined by commas, or `*` for all) keeps third-party plugins out.
    """
    return discover(importlib.metadata.entry_points(group=GROUP), os.environ.get("GEAR_DISABLE_PLUGINS", ""))


def discover(entry_points: Iterable[importlib.metadata.EntryPoint], disabled: str = "") -> Catalogue:
    """Loads built-ins and the given entry points.

    Raises:
        Exception: a built-in is broken: our bug, so it keeps its traceback.
    """
    off = {name.strip() for name in disabled.split(",") if name.strip()}
    manager = pluggy.PluginManager(hookspecs.PROJECT)
    manager.add_hookspecs(hookspecs)
    owners: dict[str, Owner] = {}
    broken: list[Broken] = []
    own = Owner(plugin="", package=DISTRIBUTION, version=_version(DISTRIBUTION))
    for module in BUILTINS:
        manager.register(importlib.import_module(module), name=module)
        owners[module] = dataclasses.replace(own, plugin=module)
    for entry_point in sorted(entry_points, key=lambda e: (e.name, e.value)):
        if entry_point.name in off or "*" in off:
            continue
        package = entry_point.dist.name if entry_point.dist else entry_point.value.split(":")[0]
        version = entry_point.dist.version if entry_point.dist else "?"
        owner = Owner(plugin=entry_point.name, package=package, version=version)
        failure = _register(manager, entry_point, f"{package}:{entry_point.name}")
        if failure is None:
            owners[f"{package}:{entry_point.name}"] = owner
        else:
            broken.append(Broken(owner=owner, stage=failure[0], problem=failure[1]))
    found, failed = _call_hooks(manager, owners)
    return Catalogue(tuple(found), (*broken, *failed))


def _register(
    manager: pluggy.PluginManager, entry_point: importlib.metadata.EntryPoint, name: str
) -> tuple[str, str] | None:
    """Stage and problem where it fails, after which nothing of the plugin stays registered."""
    stage = "import"
    try:
        plugin = _quietly(entry_point.load)
        stage = "register"
        manager.register(plugin, name=name)
        manager.check_pending()  # a misspelt hook name is an error, not a no-op
    except (Exception, SystemExit) as error:
        if manager.has_plugin(name):
            manager.unregister(name=name)
        return stage, one_line(error)
    return None


def _call_hooks(manager: pluggy.PluginManager, owners: dict[str, Owner]) -> tuple[list[PluginEntry], list[Broken]]:
    """Calls each implementation on its own, so that one that raises aborts nobody else's, and its owner is known."""
    found: list[PluginEntry] = []
    broken: list[Broken] = []
    for kind, hook in HOOK_OF.items():
        for implementation in getattr(manager.hook, hook).get_hookimpls():
            owner = owners[implementation.plugin_name]
            try:
                specs = list(as_iterable(_quietly(implementation.function)))
            except (Exception, SystemExit) as error:
                if owner.package == DISTRIBUTION:
                    raise
                broken.append(Broken(owner=owner, stage=f"hook {hook}", problem=one_line(error)))
                continue
            for spec in specs:
                problem = spec_problem(kind, spec)
                if problem is None:
                    found.append(PluginEntry(kind=kind, spec=spec, owner=owner))
                else:
                    broken.append(Broken(owner=owner, stage="spec", problem=problem))
    return found, broken


def spec_problem(kind: Kind, spec: Any) -> str | None:
    """Why a spec cannot be used, or None."""
    expected = SPEC_TYPES[kind]
    if not isinstance(spec, expected):
        return f"{HOOK_OF[kind]} returns {expected.__name__} objects, got {type(spec).__name__}"
    if spec.protocol != PROTOCOL_VERSION:
        return f"{spec.name!r} speaks protocol {spec.protocol}, this gear speaks {PROTOCOL_VERSION}; update one of them"
    if not (isinstance(spec.name, str) and NAME.fullmatch(spec.name)):
        return f"{spec.name!r} is not a plugin's name (lower case letters, digits, _)"
    if not (dataclasses.is_dataclass(spec.config) and isinstance(spec.config, type)):
        return f"{spec.name!r}: its config is not a dataclass"
    if any(
        f.default is dataclasses.MISSING and f.default_factory is dataclasses.MISSING
        for f in dataclasses.fields(spec.config)
    ):
        return f"{spec.name!r}: every option needs a default"
    build: object = spec.build
    if not callable(build):
        return f"{spec.name!r}: its build cannot be called"
    return _capability_problem(spec)


def _capability_problem(spec: AnySpec) -> str | None:
    """What of a spec's data would trip whoever lists or checks it, or None."""
    summary: object = spec.summary
    if not isinstance(summary, str) or not summary.strip() or "\n" in summary:
        return f"{spec.name!r}: its summary is not one line"
    for name, kind in CAPABILITY_TYPES.items():
        if not hasattr(spec, name):
            continue
        value = getattr(spec, name)
        if not isinstance(value, (int, float) if kind is float else kind):
            return f"{spec.name!r}: its {name} must be a {kind.__name__}, got {type(value).__name__}"
        item_kind = ITEM_TYPES.get(name, str)
        if isinstance(value, (tuple, frozenset)) and not all(isinstance(item, item_kind) for item in value):
            return f"{spec.name!r}: its {name} must hold {'names' if item_kind is str else item_kind.__name__}"
    if isinstance(spec, ModelSpec) and (problem := _model_problem(spec)) is not None:
        return f"{spec.name!r}: {problem}"
    try:
        spec.config()
    except Exception as error:
        return f"{spec.name!r}: its own defaults are refused: {one_line(error)}"
    return None


def _model_problem(spec: ModelSpec[Any]) -> str | None:
    recipe: object = spec.recipe
    convert: object = spec.convert
    starts: Mapping[Any, object] = spec.starts
    if not (recipe is None or isinstance(recipe, Recipe)):
        return f"its recipe must be a Recipe or None, got {type(recipe).__name__}"
    if not (convert is None or callable(convert)):
        return "its convert cannot be called"
    if not all(isinstance(name, str) and callable(start) for name, start in starts.items()):
        return "its starts must be functions by name"
    for weights in spec.published:
        texts: tuple[object, ...] = (weights.data, weights.source, weights.licence)
        size_mb: object = weights.size_mb
        if not (all(isinstance(text, str) for text in texts) and isinstance(size_mb, (int, float))):
            return "its published must say data, source and licence as texts and size_mb as a number"
    return None


def _quietly(call: Callable[[], Any]) -> Any:
    """Calls a plugin's code; what it prints to stdout must not get into ours."""
    with contextlib.redirect_stdout(io.StringIO()):
        return call()


def _version(distribution: str) -> str:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return "source"
