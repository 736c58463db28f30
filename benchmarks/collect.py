"""How close collecting comes to a bare loop that renders the same passes and writes nothing.

    python benchmarks/collect.py --tasks semseg --renderers classic --qualities fast --samples 20 --processes 1

Prints seconds a sample of both, measured in alternation in one run, their ratio (the target is at least 0.85), and the
worker's peak memory. Compiling and the first sample are left out of both.
"""

from __future__ import annotations

import argparse
import itertools
import multiprocessing
import os
import resource
import tempfile
import time
from pathlib import Path
from typing import Any

from gear.config.load import load_collection
from gear.dataset.store import Store
from gear.verbs.collect.job import Job, resolve
from gear.verbs.collect.pipeline import collect_samples
from gear.verbs.collect.session import Session, open_session

ROUNDS = 3


def bare_loop(session: Session, indices: range) -> float:
    """Seconds for placing and rendering, records known before."""
    records = [session.record(i) for i in indices]
    begun = time.perf_counter()
    for record in records:
        names = tuple(surface.name for surface in record.surfaces)
        placed = session.world.place(record, session.job.patch.by_surface(names))
        session.renderer.render(placed.stage, record.cameras)
    return time.perf_counter() - begun


def whole_loop(session: Session, store: Store, indices: range) -> float:
    """Seconds for planning, rendering, measuring, encoding and writing."""
    begun = time.perf_counter()
    collect_samples(session, store, indices, lambda _: None)
    return time.perf_counter() - begun


def measure(job: Job, samples: int, root: Path, barrier: Any, answers: Any) -> None:
    """Runs in its own process, in step with the others."""
    with open_session(job) as session:
        store = Store(root, job.plan)
        store.open(job.patch.files)
        bare_loop(session, range(1))
        whole_loop(session, store, range(1))
        bare_s = whole_s = 0.0
        for number in range(ROUNDS):
            block = range(number * samples, (number + 1) * samples)
            barrier.wait()
            bare_s += bare_loop(session, block)
            barrier.wait()
            whole_s += whole_loop(session, store, block)
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    answers.put((bare_s / (ROUNDS * samples), whole_s / (ROUNDS * samples), peak_mb))


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
        f"{'task':10}{'renderer':10}{'quality':9}{'processes':>9}{'bare s':>9}{'whole s':>9}{'ratio':>7}{'peak MB':>9}"
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
        bare_s, whole_s, peak_mb = (sum(values) / processes for values in zip(*results, strict=True))
        print(
            f"{task:10}{renderer:10}{quality:9}{processes:9}{bare_s:9.3f}{whole_s:9.3f}"
            f"{bare_s / whole_s:7.2f}{peak_mb:9.0f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
