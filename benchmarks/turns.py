"""Processor time of a sample, of several commits in turns in one run.

    git worktree add ../old 60a9c83
    python benchmarks/turns.py ../old . --qualities fast film

Each tree (a checkout of a commit) has a process of its own, which opens a world once and collects blocks of samples
when it is asked to; the blocks of the trees alternate, so that other work on the machine disturbs all of them alike.
Worlds are compiled, shaders are built and the first samples are made before the measurement. Each tree has its own
cache of compiled worlds, because the caches of different commits are not compatible.

Printed are the median seconds per sample for each tree, of processor time (all threads of the process) and by the
clock, and their ratios to the first tree. All files are written, to a temporary folder.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

_WORKER = """
import json, sys, time
from pathlib import Path
try:
    from gear.collecting.job import resolve
    from gear.collecting.pipeline import collect_samples
    from gear.collecting.session import open_session
except ImportError:  # commits before the room `collecting`
    from gear.verbs.collect.job import resolve
    from gear.verbs.collect.pipeline import collect_samples
    from gear.verbs.collect.session import open_session
from gear.config.load import load_collection
from gear.dataset.store import Store
flags = json.loads(sys.argv[1])
job = resolve(load_collection(None, flags))
with open_session(job) as session:
    store = Store(Path(flags["root"]) / "made", job.plan)
    store.open(job.patch.files)
    print("ready", flush=True)
    for line in sys.stdin:
        begin, end = map(int, line.split())
        clock, processor = time.perf_counter(), time.process_time()
        collect_samples(session, store, range(begin, end), lambda _: None)
        print(json.dumps([time.process_time() - processor, time.perf_counter() - clock]), flush=True)
"""


@dataclass(frozen=True, slots=True, eq=False)
class Tree:
    """A running worker of one checkout."""

    name: str
    worker: subprocess.Popen[str]

    @staticmethod
    def open(tree: Path, flags: dict[str, str], caches: Path) -> Tree:
        """Starts the worker; returns when its world is open.

        Raises:
            SystemExit: the worker failed.
        """
        caches.joinpath(tree.name).mkdir(exist_ok=True)
        env = {**os.environ, "PYTHONPATH": str(tree), "XDG_CACHE_HOME": str(caches / tree.name)}
        command = [sys.executable, "-c", _WORKER, json.dumps(flags)]
        worker = subprocess.Popen(
            command, cwd=tree, env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )  # fmt: skip
        assert worker.stdout is not None
        if worker.stdout.readline().strip() != "ready":
            raise SystemExit(f"{tree}: the worker did not start")
        return Tree(tree.name, worker)

    def seconds(self, begin: int, end: int) -> tuple[float, float]:
        """Collects samples; returns seconds of processor time and by the clock for each of them."""
        assert self.worker.stdin is not None and self.worker.stdout is not None
        self.worker.stdin.write(f"{begin} {end}\n")
        self.worker.stdin.flush()
        processor, clock = json.loads(self.worker.stdout.readline())
        return processor / (end - begin), clock / (end - begin)

    def close(self) -> None:
        """Ends the worker."""
        assert self.worker.stdin is not None
        self.worker.stdin.close()
        self.worker.wait()


def compare(trees: Sequence[Path], flags: dict[str, str], rounds: int, block: int, warm: int, caches: Path) -> str:
    """Measures one configuration with all trees in turns; returns rows of a Markdown table."""
    with tempfile.TemporaryDirectory() as folder:
        flags = {**flags, "samples": str(warm + rounds * block)}
        opened = [Tree.open(tree, {**flags, "root": f"{folder}/{i}"}, caches) for i, tree in enumerate(trees)]
        for tree in opened:
            tree.seconds(0, warm)
        spent: list[list[tuple[float, float]]] = [[] for _ in opened]
        for number in range(rounds):
            for tree, measured in zip(opened, spent, strict=True):
                measured.append(tree.seconds(warm + number * block, warm + (number + 1) * block))
        for tree in opened:
            tree.close()
    medians = [[statistics.median(part) for part in zip(*measured, strict=True)] for measured in spent]
    first = medians[0]
    return "\n".join(
        f"| {flags['task']} `{flags['quality']}` | {tree.name} | {processor:.2f} s | {processor / first[0]:.2f} "
        f"| {clock:.2f} s | {clock / first[1]:.2f} |"
        for tree, (processor, clock) in zip(opened, medians, strict=True)
    )


def main() -> None:
    """Prints a table with one row for each configuration and tree."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("trees", nargs="+", type=Path, help="checkouts; the others are compared with the first")
    parser.add_argument("--tasks", nargs="+", default=["semseg"])
    parser.add_argument("--qualities", nargs="+", default=["fast", "film"])
    parser.add_argument("--scene", default="billboard04")
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--block", type=int, default=2, help="samples in each round and tree")
    parser.add_argument("--warm", type=int, default=2, help="samples before the measurement")
    parser.add_argument("--caches", type=Path, default=Path(tempfile.gettempdir()) / "gear-turns")
    args = parser.parse_args()
    args.caches.mkdir(exist_ok=True)
    trees = [tree.resolve() for tree in args.trees]
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}\n")
    print("| configuration | tree | processor time | ratio | by the clock | ratio |\n|---|---|---|---|---|---|")
    for task in args.tasks:
        for quality in args.qualities:
            flags = {"task": task, "quality": quality, "patch": "random", "scene": args.scene}
            print(compare(trees, flags, args.rounds, args.block, args.warm, args.caches), flush=True)


if __name__ == "__main__":
    main()
