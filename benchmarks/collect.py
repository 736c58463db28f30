"""How close collecting comes to a bare loop that renders the same passes and writes nothing.

    python benchmarks/collect.py
    python benchmarks/collect.py --tasks semseg --renderers classic --qualities fast --samples 20 --processes 1

The first prints every task with every renderer and quality, with one process and with two.

The bare loop places a scene, renders colour, depth and ids, and lets the camera pipeline turn them into a picture: air,
water and response are part of the picture. The whole loop also plans the scenes, measures, encodes and writes. Both are
measured in alternation in one run; compiling and the
first sample are left out.

Printed are seconds a sample of both, how much of the bare loop's is the camera's, their ratio (the target is at least
0.85), the same in seconds of processor time, which other work on the machine disturbs less, and a worker's peak memory.
"""

from __future__ import annotations

import argparse
import itertools
import multiprocessing
import os
import resource
import tempfile
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gear.collecting.job import Job, resolve
from gear.collecting.pipeline import collect_samples
from gear.collecting.session import Session, open_session
from gear.config.load import load_collection
from gear.dataset.store import Store

ROUNDS = 3


@dataclass(frozen=True, slots=True)
class Spent:
    """Seconds by the clock, and of processor time of all threads."""

    wall_s: float = 0.0
    cpu_s: float = 0.0

    @staticmethod
    def now() -> Spent:
        return Spent(time.perf_counter(), time.process_time())

    def __add__(self, other: Spent) -> Spent:
        return Spent(self.wall_s + other.wall_s, self.cpu_s + other.cpu_s)

    def __sub__(self, other: Spent) -> Spent:
        return Spent(self.wall_s - other.wall_s, self.cpu_s - other.cpu_s)

    def over(self, number: int) -> Spent:
        return Spent(self.wall_s / number, self.cpu_s / number)


@dataclass(frozen=True, slots=True)
class Figures:
    """What one process measured, a sample."""

    bare: Spent
    camera: Spent
    whole: Spent
    peak_mb: float


def bare_loop(session: Session, indices: range) -> tuple[Spent, Spent]:
    """Times of placing, rendering and the camera pipeline, with records planned earlier; and of the pipeline alone."""
    records = [session.record(i) for i in indices]
    camera, begun = Spent(), Spent.now()
    for record in records:
        shot = session.shoot(record)
        rendered = Spent.now()
        session.to_frame(shot)
        camera += Spent.now() - rendered
    return Spent.now() - begun, camera


def whole_loop(session: Session, store: Store, indices: range) -> Spent:
    """For planning, rendering, measuring, encoding and writing."""
    begun = Spent.now()
    collect_samples(session, store, indices, lambda _: None)
    return Spent.now() - begun


def measure(job: Job, samples: int, root: Path, barrier: Any, answers: Any) -> None:
    """Runs in its own process, in step with the others."""
    with open_session(job) as session:
        store = Store(root, job.plan)
        store.open(job.patch.files)
        bare_loop(session, range(1))
        whole_loop(session, store, range(1))
        bare, camera, whole = Spent(), Spent(), Spent()
        for number in range(ROUNDS):
            block = range(number * samples, (number + 1) * samples)
            barrier.wait()
            one, of_it = bare_loop(session, block)
            bare, camera = bare + one, camera + of_it
            barrier.wait()
            whole += whole_loop(session, store, block)
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    number = ROUNDS * samples
    answers.put(Figures(bare.over(number), camera.over(number), whole.over(number), peak_mb))


def mean(parts: Iterable[Spent]) -> Spent:
    """Over processes."""
    several = list(parts)
    return sum(several, Spent()).over(len(several))


def main() -> None:
    """Prints one line a combination."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", nargs="+", default=["semseg", "detect2d", "stereo3d", "depth"])
    parser.add_argument("--renderers", nargs="+", default=["filament", "classic"])
    parser.add_argument("--qualities", nargs="+", default=["film", "fast"])
    parser.add_argument("--processes", nargs="+", type=int, default=[1, 2])
    parser.add_argument("--samples", type=int, default=8, help="a round; there are three rounds of each loop")
    parser.add_argument("--scene", default="billboard01")
    args = parser.parse_args()
    print(f"{os.cpu_count()} cores")
    print(
        f"{'task':10}{'renderer':10}{'quality':9}{'processes':>9}"
        f"{'bare s':>9}{'camera s':>10}{'whole s':>9}{'ratio':>7}"
        f"{'bare cpu':>10}{'whole cpu':>11}{'ratio':>7}{'peak MB':>9}"
    )
    context = multiprocessing.get_context("spawn")
    for task, renderer, quality, processes in itertools.product(
        args.tasks, args.renderers, args.qualities, args.processes
    ):
        with tempfile.TemporaryDirectory() as folder:
            flags = {"task": task, "renderer": renderer, "quality": quality, "patch": "random", "scene": args.scene}
            job = resolve(load_collection(None, {**flags, "root": folder, "samples": str(ROUNDS * args.samples)}))
            barrier, answers = context.Barrier(processes), context.Queue()
            workers = [
                context.Process(target=measure, args=(job, args.samples, Path(folder) / str(i), barrier, answers))
                for i in range(processes)
            ]
            for worker in workers:
                worker.start()
            results = [answers.get() for _ in workers]
            for worker in workers:
                worker.join()
        bare, camera, whole = (mean(getattr(r, name) for r in results) for name in ("bare", "camera", "whole"))
        print(
            f"{task:10}{renderer:10}{quality:9}{processes:9}"
            f"{bare.wall_s:9.3f}{camera.wall_s:10.3f}{whole.wall_s:9.3f}{bare.wall_s / whole.wall_s:7.2f}"
            f"{bare.cpu_s:10.3f}{whole.cpu_s:11.3f}{bare.cpu_s / whole.cpu_s:7.2f}"
            f"{max(r.peak_mb for r in results):9.0f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
