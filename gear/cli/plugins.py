"""`gear plugins`."""

from __future__ import annotations

import argparse
import dataclasses
import json
from typing import TYPE_CHECKING, Any

from gear.contracts.specs import KINDS, Kind

if TYPE_CHECKING:
    from gear.plugins.catalogue import Catalogue, Found

EXAMPLE = """examples:
  gear plugins
  gear plugins --kind task --json
  gear plugins show semseg
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the command's flags."""
    parser.epilog = EXAMPLE
    parser.add_argument("action", nargs="?", choices=("list", "show"), default="list", help="list, or show one (list)")
    parser.add_argument("name", nargs="?", help="with show: its name, or package/name")
    parser.add_argument("--kind", choices=KINDS, help="only this kind")
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument("--strict-plugins", action="store_true", help="a plugin that failed to load is an error")


def run(args: argparse.Namespace) -> int:
    """Lists plugins, or prints one with its options."""
    from gear.plugins.manager import catalogue

    found = catalogue()
    if args.strict_plugins and found.broken:
        raise found.broken[0].error()
    if args.action == "show":
        return show(found, args)
    kinds: tuple[Kind, ...] = (args.kind,) if args.kind else KINDS
    rows = [summary(f) for kind in kinds for f in found.of_kind(kind)]
    broken = [
        {"plugin": b.owner.plugin, "package": b.owner.package, "version": b.owner.version, "stage": b.stage,
         "problem": b.problem} for b in found.broken
    ]  # fmt: skip
    if args.json:
        print(json.dumps({"plugins": rows, "broken": broken}, indent=1))
        return 0
    for row in rows:
        print(f"{row['kind']:8} {row['name']:20} {row['package']} {row['version']}  {row['summary']}")
    for b in broken:
        print(f"broken   {b['plugin']:20} {b['package']} {b['version']}  at {b['stage']}: {b['problem']}")
    for kind, name, choices in found.clashes():
        print(f"clash    {name:20} {kind}: say {' or '.join(choices)}")
    return 0


def show(found: Catalogue, args: argparse.Namespace) -> int:
    """Prints one plugin with its options."""
    from gear.values.errors import GearError, UnknownNameError

    if not args.name:
        raise GearError("gear plugins show needs a name, such as: gear plugins show semseg")
    kinds: tuple[Kind, ...] = (args.kind,) if args.kind else KINDS
    for kind in kinds:
        try:
            plugin = found.get(kind, args.name)
        except UnknownNameError:
            continue
        facts = summary(plugin) | {"options": options(plugin.spec.config)}
        if args.json:
            print(json.dumps(facts, indent=1))
        else:
            print(f"{facts['kind']} {facts['name']} ({facts['package']} {facts['version']}): {facts['summary']}")
            for key, value in facts["capabilities"].items():
                print(f"  {key}: {value}")
            print("options (in a config under `options:`, or --set options.KEY=VALUE):")
            for key, (kind_text, default) in facts["options"].items():
                print(f"  {key}: {kind_text} = {default}")
            print((plugin.spec.config.__doc__ or "").rstrip())
        return 0
    known = [name for kind in kinds for name in found.names(kind)]
    raise UnknownNameError("plugin", args.name, known)


def summary(found: Found) -> dict[str, Any]:
    """What a list shows of a plugin."""
    common = {"name", "summary", "config", "build", "protocol"}
    capabilities = {
        field.name: sorted(value) if isinstance(value := getattr(found.spec, field.name), frozenset) else value
        for field in dataclasses.fields(found.spec)
        if field.name not in common
    }
    return {
        "kind": found.kind,
        "name": found.spec.name,
        "package": found.owner.package,
        "version": found.owner.version,
        "summary": found.spec.summary,
        "capabilities": capabilities,
    }


def options(config: type[Any]) -> dict[str, tuple[str, Any]]:
    """Type and default of each option, nested ones with dots."""
    from gear.config.dump import to_plain

    defaults = config()
    result: dict[str, tuple[str, Any]] = {}
    for field in dataclasses.fields(config):
        default = getattr(defaults, field.name)
        if dataclasses.is_dataclass(default) and not isinstance(default, type):
            result.update({f"{field.name}.{key}": value for key, value in options(type(default)).items()})
        else:
            result[field.name] = (str(field.type), to_plain(default))
    return result
