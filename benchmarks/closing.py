"""Measures closing a large split: `python benchmarks/closing.py [SAMPLES] [TASK]`.

The split is synthetic: a few scenes are drawn, and each sidecar is a copy of one of them with another index. There are
no pictures, because closing reads none. Afterwards the split is extended by 1 % and closed again.
"""

from __future__ import annotations

import argparse
import dataclasses
import multiprocessing
import resource
import tempfile
import time
from pathlib import Path
from typing import Any

from gear.contracts.tasks import Sidecar, SplitInfo
from gear.dataset.layout import sidecar_path
from gear.dataset.plan import Plan
from gear.dataset.sidecar import sidecar_bytes
from gear.dataset.store import Store
from gear.plugins.build import build_task
from gear.testing.synthetic import synthetic_frame

DRAWN = 8
"""Number of scenes that are drawn; the sidecars repeat them."""


def plan_of(task: str, samples: int) -> Plan:
    """The plan of a synthetic split."""
    return Plan(
        task={"name": task, "package": "mujoco-gear", "version": "0"},
        options={},
        content={"scene": "billboard01", "seed": 5},
        patch={"label": "none", "sha256": ""},
        info=SplitInfo(town="town10", scene="billboard01", split="train", seed=5, patch_label="none"),
        samples=samples,
    )


def drawn_sidecars(task: Any, info: SplitInfo) -> list[Sidecar]:
    """The sidecars of a few synthetic scenes."""
    found = []
    for index in range(DRAWN):
        frame, record = synthetic_frame(task.rig(), index=index, seed=5)
        sample = task.ground_truth(frame, dataclasses.replace(record, split=info.split))
        encoded = task.encode(sample, info)
        files = dict.fromkeys(encoded.files, "0" * 64)
        found.append(Sidecar(record=sample.record, surfaces=sample.surfaces, facts=encoded.facts, files=files))
    return found


def fill(root: Path, task: str, start: int, stop: int) -> None:
    """Writes the sidecars of some samples."""
    plan = plan_of(task, stop)
    drawn = drawn_sidecars(build_task(task)[1], plan.info)
    Store(root, plan).open({})
    for index in range(start, stop):
        sidecar = drawn[index % DRAWN]
        record = dataclasses.replace(sidecar.record, index=index, sequence=index)
        path = root / sidecar_path("train", index)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(sidecar_bytes(dataclasses.replace(sidecar, record=record)))


def close(root: Path, task: str, samples: int) -> None:
    """Closes the split and prints the time and the memory of this process."""
    built = build_task(task)[1]
    store = Store(root, plan_of(task, samples))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start, processor = time.monotonic(), time.process_time()
    store.close(built, {"seed": 5})
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(
        f"{task}: {samples} samples closed in {time.monotonic() - start:.1f} s ({time.process_time() - processor:.1f} s"
        f" of a processor); memory {used / 1024:.0f} MiB, {before / 1024:.0f} MiB before",
        flush=True,
    )


def in_process(function: Any, *arguments: Any) -> None:
    """Calls a function in a fresh process, so that its memory is its own."""
    process = multiprocessing.get_context("spawn").Process(target=function, args=arguments)
    process.start()
    process.join()


def main() -> None:
    """Prints one line for the split, and one for its extension."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("samples", nargs="?", type=int, default=20_000)
    parser.add_argument("task", nargs="?", default="detect2d")
    args = parser.parse_args()
    samples, task = args.samples, args.task
    with tempfile.TemporaryDirectory(prefix="gear-closing-") as folder:
        root = Path(folder)
        fill(root, task, 0, samples)
        in_process(close, root, task, samples)
        more = samples + samples // 100
        fill(root, task, samples, more)
        in_process(close, root, task, more)


if __name__ == "__main__":
    main()
