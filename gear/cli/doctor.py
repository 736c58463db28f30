"""`gear doctor`."""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys

EXAMPLE = """examples:
  gear doctor
  gear doctor --renderer filament --json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the command's flags."""
    parser.epilog = EXAMPLE
    parser.add_argument("--renderer", help="only this one: raster, filament or classic")
    parser.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Probes the renderers; 0 if at least one works (or the one asked for does), else 2."""
    from gear.render.probing import probe
    from gear.render.registry import RENDERERS, describe
    from gear.values.errors import BackendError

    results: dict[str, dict[str, object]] = {}
    for name in [args.renderer] if args.renderer else RENDERERS:
        about = describe(name)
        try:
            result = probe(name)
        except BackendError as error:
            results[name] = {"works": False, "about": about, "problem": error.problem, "remedy": error.remedy}
        else:
            facts = dataclasses.asdict(result.info)
            facts.pop("name")
            results[name] = {"works": True, "about": about, **facts, "sha256": result.sha256,
                             "start_s": round(result.start_s, 3), "frame_s": round(result.frame_s, 4)}  # fmt: skip
    if args.json:
        print(json.dumps({"python": sys.version.split()[0], "renderers": results}, indent=1))
    else:
        for name, facts in results.items():
            print(f"{name}: {'works' if facts['works'] else 'does not work'}")
            for key, value in facts.items():
                if key != "works":
                    print(f"  {key.replace('_', ' '):12} {value}")
    return 0 if any(facts["works"] for facts in results.values()) else 2
