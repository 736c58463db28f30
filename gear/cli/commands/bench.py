"""`gear bench`: runs a whole benchmark of networks, defenses, scenes and patches, and writes a report."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from gear.cli.engine import add_engine
from gear.cli.flag_types import workers
from gear.cli.log import add_log
from gear.cli.settings import add_settings

if TYPE_CHECKING:
    from gear.verbs.bench.plan import Step
    from gear.verbs.bench.report import BenchReport
    from gear.verbs.bench.sweep import SweepReport
    from gear.verbs.bench.times import TimesReport

EXAMPLE = """examples:
  gear bench quick --out bench/quick                      one scene, one network, a few minutes on two cores
  gear bench paper --out bench/paper --list               only prints the commands of the benchmark
  gear bench my.yml --out bench/mine --device cuda
  gear bench my.yml --out bench/mine --engine slurm --address gpu --workers 32
  gear bench ablation-samples --out bench/samples         one bench for each value of a key, and a figure
  gear bench quick --out bench/long --set samples.measure=96 --set 'places={town10: []}'

The folder --out gets report.html, table.txt, bench.csv and bench.json. Run the same command again to continue after an
interruption, or after adding networks, defenses or scenes: existing results are kept.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of `gear bench` to its argument parser."""
    parser.epilog = EXAMPLE
    parser.add_argument("config", metavar="CONFIG", help="name (quick, paper, ablation-samples, times, ...) or path")
    parser.add_argument("--out", required=True, metavar="DIR", help="folder for data, patches, results and the report")
    add_settings(parser, "--set", help="sets a key of the config; repeatable")
    parser.add_argument(
        "--device", choices=("auto", "cpu", "cuda"), help="device of the networks (the one in the config)"
    )
    add_engine(parser, "that carries out the steps")
    parser.add_argument(
        "--workers", type=workers, default=1, metavar="N", help="number of steps at the same time, or auto (1)"
    )
    parser.add_argument(
        "--record",
        nargs="?",
        const=True,
        default=False,
        choices=("model", "defense", "attack"),
        metavar="KIND",
        help="also write records for a leaderboard into OUT/records; `attack` for an attack against rows of others",
    )
    add_log(parser)
    parser.add_argument("--list", action="store_true", help="only print the commands of the benchmark")
    parser.add_argument("--json", action="store_true", help="print bench.json, or the steps, in place of the tables")


def run(args: argparse.Namespace) -> int:
    """Runs the benchmark and prints its tables, or with `--list` only prints its steps; returns exit code 0.

    Args:
        args: arguments of the command line, as the parser of this command returns them.
    """
    import json
    from pathlib import Path

    from gear.cli.requests import request_of
    from gear.cli.streams import folded
    from gear.reporting.display import Display
    from gear.verbs.bench.command import command
    from gear.verbs.bench.drives.steps import every_step
    from gear.verbs.bench.request import BenchRequest
    from gear.verbs.bench.run import prepared, run_bench
    from gear.verbs.bench.sweep import requests_of, run_sweep, sweep_of
    from gear.verbs.bench.table import text
    from gear.verbs.bench.times import measures_times, run_times, steps_of, times_of

    request = request_of(BenchRequest, args, in_subprocess=True)
    is_timed = measures_times(request)
    chosen, seed = (None, 0) if is_timed else sweep_of(request)
    if args.list:
        requests = [request] if chosen is None else [one for _, one in requests_of(request, chosen, seed)]
        timed = [step for _, step in steps_of(times_of(request), Path(request.out))] if is_timed else []
        steps = timed or [step for one in requests for step in every_step(prepared(one))]
        listed = [{"verb": step.verb, "title": step.title, "arguments": step.arguments} for step in steps]
        print(json.dumps(listed, indent=1) if args.json else "\n".join(map(command, steps)))
        return 0
    with Display("bench") as display:

        def begin(step: Step, number: int, steps: int) -> None:
            display.begin(f"[{number}/{steps}] {step.title}", unit="step" if step.verb == "attack" else "sample")

        def ended(step: Step, number: int, steps: int) -> None:
            display.write(f"[{number}/{steps}] {step.title}: finished")

        if request.is_scheduled:
            display.begin("steps of the bench", unit="step")
        on_step = ended if request.is_scheduled else begin
        report: BenchReport | SweepReport | TimesReport
        if is_timed:
            report = run_times(request, display.callbacks, on_step)
            shown = report.text()
        elif chosen is None:
            report = run_bench(request, display.callbacks, on_step)
            shown = text(report)
        else:
            report = run_sweep(request, display.callbacks, on_step)
            shown = report.text()
    print(json.dumps(report.as_json(), indent=1, allow_nan=False) + "\n" if args.json else folded(shown), end="")
    return 0
