"""Measures large splits: `python benchmarks/scale.py soak [SAMPLES]`, `store [SAMPLES]` or `extend [SAMPLES] [MORE]`.

- `soak` collects small pictures of the tiny town in this process, and prints its memory every tenth part.
- `store` writes small synthetic samples of the task depth (160 × 80) with all their files, as a collection does, and
  closes the split. No picture is rendered.
- `extend` closes a split of synthetic sidecars without pictures, extends it, and closes it again.
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
import time
from pathlib import Path
from typing import Any

import closing

import gear
from gear.config.nodes import parse_text
from gear.dataset.checks.existing_samples import refuse_damaged
from gear.dataset.store import Store
from gear.plugins.build import build_task
from gear.testing.synthetic import synthetic_frame
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN

PAGE_MIB = 4096 / 2**20


def memory_mib() -> float:
    """Resident memory of this process."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE_MIB


def soak(samples: int) -> None:
    """Prints the memory of a long collection."""
    start, processor = time.monotonic(), time.process_time()

    def show(done: int, total: int) -> None:
        if done % max(1, total // 10) == 0:
            print(f"{done} of {total}: {memory_mib():.0f} MiB, {time.monotonic() - start:.0f} s", flush=True)

    with tempfile.TemporaryDirectory(prefix="gear-soak-") as folder:
        gear.collect(
            "semseg",
            town=TINY_TOWN,
            scene="board",
            split="train",
            samples=samples,
            renderer="classic",
            quality="fast",
            out=Path(folder) / "data",
            settings=[f"scenes={TINY_SCENES}", "options.width_px=256", "options.height_px=128"],
            on_progress=show,
        )
    print(f"processor: {(time.process_time() - processor) / samples * 1000:.1f} ms per sample")


def store(samples: int) -> None:
    """Prints the time of the parts of a collection that do not render."""
    plan = dataclasses.replace(closing.plan_of("depth", samples), options={"width_px": 160, "height_px": 80})
    _, task = build_task("depth", parse_text('{"width_px": 160, "height_px": 80}', "options"))
    drawn = [synthetic_frame(task.rig(), index=index, seed=5) for index in range(closing.DRAWN)]
    with tempfile.TemporaryDirectory(prefix="gear-store-") as folder:
        made = Store(Path(folder) / "data", plan)
        with Timed("begin"):
            made.open({})
        with Timed(f"write {samples} samples"):
            for index in range(samples):
                frame, record = drawn[index % len(drawn)]
                record = dataclasses.replace(record, index=index, sequence=index, split="train")
                sample = task.ground_truth(frame, record)
                made.write(sample, task.encode(sample, plan.info))
        with Timed("close"):
            made.close(task, {"seed": 5})
        with Timed("run the same command again: find missing samples, check all hashes"):
            made.open({})
            assert not made.missing()
            refuse_damaged(made)
        with Timed("close again"):
            made.close(task, {"seed": 5})


def extend(samples: int, more: int) -> None:
    """Prints the time of closing a split, and of closing it again after more samples were made."""
    for task in ("depth", "detect2d"):
        with tempfile.TemporaryDirectory(prefix="gear-extend-") as folder:
            root = Path(folder)
            closing.fill(root, task, 0, samples)
            closing.in_process(closing.close, root, task, samples)
            closing.fill(root, task, samples, samples + more)
            closing.in_process(closing.close, root, task, samples + more)


class Timed:
    """A context that prints the wall time, the processor time and the memory of a step."""

    def __init__(self, what: str) -> None:
        self.what = what

    def __enter__(self) -> None:
        self.start, self.processor = time.monotonic(), time.process_time()

    def __exit__(self, *_: object) -> None:
        wall, processor = time.monotonic() - self.start, time.process_time() - self.processor
        print(f"{self.what}: {wall:.1f} s, processor {processor:.1f} s, memory {memory_mib():.0f} MiB", flush=True)


def main() -> None:
    """Runs one of the three measurements."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("measurement", nargs="?", default="soak", choices=tuple(DEFAULTS))
    parser.add_argument("numbers", nargs="*", type=int, metavar="SAMPLES")
    args = parser.parse_args()
    function, *defaults = DEFAULTS[args.measurement]
    function(*args.numbers, *defaults[len(args.numbers) :])


DEFAULTS: dict[str, tuple[Any, ...]] = {"soak": (soak, 300), "store": (store, 10_000), "extend": (extend, 2000, 100)}
"""Function and default numbers of samples of each measurement."""

if __name__ == "__main__":
    main()
