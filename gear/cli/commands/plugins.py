"""`gear plugins`: lists the installed plugins, or prints one plugin with its options."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING

from gear.cli.streams import line_width, wrapped
from gear.contracts.specs import KINDS, Kind
from gear.measuring.text_table import text_table

if TYPE_CHECKING:
    from gear.plugins.catalogue import Catalogue, PluginEntry

EXAMPLE = """examples:
  gear plugins
  gear plugins --kind task --json
  gear plugins show semseg                     # capabilities and options of one
  GEAR_DISABLE_PLUGINS='*' gear plugins        # gear's own alone; or names of plugins, joined by commas
"""

OPTION_FLAGS: dict[Kind, str] = {
    "task": "--set options.KEY=VALUE, or in a config under `options:`",
    "model": "--model-set KEY=VALUE; with gear train --set options.KEY=VALUE",
    "attack": "--set KEY=VALUE; with gear train --set adversarial.options.KEY=VALUE",
    "defense": "--defense-set KEY=VALUE; with gear defend --set KEY=VALUE",
    "controller": "in a drive config under `set:` of the driver",
    "metric": "--report NAME:KEY=VALUE,...",
    "logger": "--log-set KEY=VALUE",
}
"""How users set the options of a plugin, by its kind."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear plugins` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument(
        "action", nargs="?", choices=("list", "show"), default="list", help="list all, or show one (list)"
    )
    parser.add_argument("name", nargs="?", help="name of the plugin, or package/name, with show")
    parser.add_argument("--kind", choices=KINDS, help="only plugins of this kind")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--strict-plugins", action="store_true", help="a plugin that failed to load is an error")


def run(args: argparse.Namespace) -> int:
    """Prints the list of plugins, or one plugin with its options; returns exit code 0.

    Args:
        args: arguments of the command line: `action`, `name`, `kind`, `json` and `strict_plugins`.
    """
    from gear.plugins.manager import catalogue

    found = catalogue()
    if args.strict_plugins and found.broken:
        raise found.broken[0].error()
    kinds: tuple[Kind, ...] = (args.kind,) if args.kind else KINDS
    if args.action == "show":
        return show(found, kinds, args)
    return show_all(found, kinds, args.json)


def show_all(catalogue: Catalogue, kinds: tuple[Kind, ...], as_json: bool) -> int:
    """Prints the working plugins, the broken plugins, and the names that several plugins share; returns exit code 0.

    Args:
        catalogue: all plugins.
        kinds: kinds of plugins to print.
        as_json: whether JSON is printed.
    """
    from gear.plugins.describe import summary

    rows = [summary(plugin) for kind in kinds for plugin in catalogue.of_kind(kind)]
    clashes = [clash for clash in catalogue.clashes() if clash[0] in kinds]
    if as_json:
        broken = [
            {"plugin": b.owner.plugin, "package": b.owner.package, "version": b.owner.version, "stage": b.stage,
             "problem": b.problem} for b in catalogue.broken
        ]  # fmt: skip
        named = [{"kind": kind, "name": name, "choices": choices} for kind, name, choices in clashes]
        print(json.dumps({"plugins": rows, "broken": broken, "clashes": named}, indent=1))
        return 0
    cells = [[row["kind"], row["name"], f"{row['package']} {row['version']}", row["summary"]] for row in rows]
    if cells:
        print("\n".join(text_table(("kind", "name", "package", "summary"), cells, width=line_width())))
    for b in catalogue.broken:
        remedy = f"tell its author, uninstall {b.owner.package}, or set GEAR_DISABLE_PLUGINS={b.owner.plugin}"
        print(f"broken   {b.owner.plugin:20} {b.owner.package} {b.owner.version}  at {b.stage}: {b.problem}; {remedy}")
    for kind, name, choices in clashes:
        print(f"clash    {name:20} {kind}: say {' or '.join(choices)}")
    return 0


def show(catalogue: Catalogue, kinds: tuple[Kind, ...], args: argparse.Namespace) -> int:
    """Prints one plugin with its source, capabilities and options; returns exit code 0.

    Args:
        catalogue: all plugins.
        kinds: kinds in which the name is looked up.
        args: parsed arguments of the command, with the name.
    """
    from gear.plugins.describe import options, source_of, summary, training

    plugin = the_one(catalogue, kinds, args.name)
    trained = training(plugin.spec)
    facts = summary(plugin) | trained | {"source": source_of(plugin.spec), "options": options(plugin.spec.config)}
    if args.json:
        print(json.dumps(facts, indent=1))
        return 0
    lines = [f"{facts['kind']} {facts['name']} ({facts['package']} {facts['version']}): {facts['summary']}"]
    lines.append(f"  source: {facts['source']}")
    lines += [f"  {key}: {_text(value)}" for key, value in facts["capabilities"].items()]
    for key, value in trained.items():
        parts = [f"{name}={part}" for name, part in value.items()] if isinstance(value, dict) else value
        lines.append(f"  {key}: {_text(parts)}")
    lines.append(f"options ({OPTION_FLAGS[plugin.kind]}):" if facts["options"] else "no options")
    for option in facts["options"]:
        unit = f" [{option['unit']}]" if option["unit"] else ""
        lines.append(f"  {option['name']}: {option['type']} = {_text(option['default'])}{unit}")
        if option["meaning"]:
            lines.append(f"      {option['meaning']}")
    print("\n".join(map(wrapped, lines)))
    return 0


def the_one(catalogue: Catalogue, kinds: tuple[Kind, ...], name: str | None) -> PluginEntry:
    """Returns the plugin with the given name, of any of the given kinds, for `gear plugins show`.

    Args:
        catalogue: all installed plugins.
        kinds: kinds of plugins to search, such as `task`.
        name: name of the plugin, or `<package>/<name>`; None if the user gave none.

    Raises:
        GearError: no name was given, or plugins of several kinds have this name.
        UnknownNameError: no installed plugin has this name.
        DuplicateNameError: plugins of two packages have this name.
    """
    from gear.values.errors import GearError, UnknownNameError

    if not name:
        raise GearError("gear plugins show needs a name, such as: gear plugins show semseg")
    hits = [kind for kind in kinds if any(name in (f.spec.name, f.full_name) for f in catalogue.of_kind(kind))]
    if len(hits) > 1:
        raise GearError(f"{name!r} is the name of plugins of several kinds; add --kind {' or --kind '.join(hits)}")
    if not hits:
        known = [other for kind in kinds for other in catalogue.names(kind)]
        raise UnknownNameError(kinds[0] if len(kinds) == 1 else "plugin", name, known, catalogue.broken_hint())
    return catalogue.get(hits[0], name)


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (list, tuple)):
        return ", ".join(map(str, value)) or "-"
    return "-" if value in ("", None) else str(value)
