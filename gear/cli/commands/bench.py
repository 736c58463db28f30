"""`gear bench`."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from gear.cli.commands.collect import positive

if TYPE_CHECKING:
    from gear.cli.progress import ProgressBar
    from gear.verbs.bench.plan import Step

EXAMPLE = """examples:
  gear bench quick --out bench/quick                      one scene, one network, a few minutes on two cores
  gear bench paper --out bench/paper --list               the commands that it comes to, and nothing is done
  gear bench my.yml --out bench/mine --device cuda --workers 8
  gear bench quick --out bench/long --set samples.measure=96 --set 'places={town10: []}'

report.html, table.txt, bench.csv and bench.json lie under --out. Run it again to go on where it was stopped, or after
networks, defenses or scenes were added: what is there is not done twice.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the command's flags to its parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("config", metavar="CONFIG", help="name (quick, paper) or path of a bench config")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for data, patches, results and the report")
    parser.add_argument(
        "--set", metavar="KEY=VALUE", action="append", default=[], dest="settings", help="a key of the config"
    )
    parser.add_argument("--device", choices=("auto", "cpu", "cuda"), help="where networks run (as the config says)")
    parser.add_argument("--workers", type=positive, default=1, metavar="N", help="processes of each collection (1)")
    parser.add_argument(
        "--list", action="store_true", help="print the commands that the bench consists of, and run none"
    )
    parser.add_argument("--json", action="store_true", help="print bench.json, or the steps, in place of the tables")


def run(args: argparse.Namespace) -> int:
    """Runs the bench and prints its tables."""
    import json

    from gear.verbs.bench.command import command
    from gear.verbs.bench.run import bench, prepared
    from gear.verbs.bench.table import text

    given = {"out": args.out, "settings": args.settings, "device": args.device, "workers": args.workers}
    if args.list:
        steps = list(prepared(args.config, **given).steps())
        listed = [{"verb": step.verb, "title": step.title, "arguments": step.arguments} for step in steps]
        print(json.dumps(listed, indent=1) if args.json else "\n".join(map(command, steps)))
        return 0
    with _Bars() as bars:
        report = bench(
            args.config,
            **given,
            apart=True,
            on_step=bars.on_step,
            on_progress=bars.on_progress,
            on_fit_progress=bars.on_fit_progress,
            on_warning=bars.on_warning,
        )
    print(json.dumps(report.as_json(), indent=1, allow_nan=False) + "\n" if args.json else text(report), end="")
    return 0


class _Bars:
    """Prints the title of each step, with a progress bar of its own."""

    def __init__(self) -> None:
        self._bar: ProgressBar | None = None
        self._lesson: ProgressBar | None = None

    def on_step(self, step: Step, number: int, steps: int) -> None:
        """Prints the step's title."""
        import sys

        self._close()
        if sys.stderr.isatty():
            print(f"[{number}/{steps}] {step.title}", file=sys.stderr)

    def on_progress(self, done: int, total: int) -> None:
        """Moves the step's bar."""
        self._bar = self._bar or _bar("sample")
        self._bar(done, total)

    def on_fit_progress(self, done: int, total: int) -> None:
        """Moves the bar of a defense that learns."""
        self._lesson = self._lesson or _bar("picture")
        self._lesson(done, total)

    def on_warning(self, line: str) -> None:
        """Prints it."""
        import sys

        print(f"gear: note: {line}", file=sys.stderr)

    def _close(self) -> None:
        for bar in (self._lesson, self._bar):
            if bar is not None:
                bar.__exit__(None, None, None)
        self._bar = self._lesson = None

    def __enter__(self) -> _Bars:
        return self

    def __exit__(self, *error: object) -> None:
        self._close()


def _bar(unit: str) -> ProgressBar:
    from gear.cli.progress import ProgressBar

    return ProgressBar(unit=unit)
