"""How close evaluating comes to the model's bare forward passes over pictures that are in memory already.

Bare is what anybody would write, `model.forward` on tensors without gradients; `predict` adds what makes the task's
predictions of it, and is quicker than the forward pass where gear has a copy of the network for predictions.

    python benchmarks/evaluate.py --data DIR --model ddrnet23_slim --set weights=none --samples 16

Prints seconds a sample of each, measured in alternation in one run, and their ratios (target: at most 1.1 of
bare). Building the model and the first sample are left out of both; intervals are timed apart.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import torch

import gear
from gear.contracts.tasks import Sidecar
from gear.dataset.reading import Dataset
from gear.measuring.dataset_run import evaluate_row
from gear.measuring.guard import Guard, open_guard
from gear.measuring.guarded_model import GuardedModel
from gear.measuring.intervals import leave_one_out
from gear.measuring.plugin_selection import chosen_model
from gear.measuring.reports import TASK
from gear.measuring.scoring import Scorer
from gear.measuring.statistics import gather
from gear.networks.network import as_batch


class Part(Dataset[Any]):
    """The first samples of a split, and again from the start where more are wanted than there are."""

    wanted = 0

    def __len__(self) -> int:
        return self.wanted

    def sidecar(self, index: int) -> Sidecar:
        """Of one sample."""
        return super().sidecar(index % len(self.manifest["samples"]))


def main() -> None:
    """Prints one line a round, then the medians."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", required=True)
    parser.add_argument("--model", default="ddrnet23_slim")
    parser.add_argument("--set", action="append", default=[], dest="settings")
    parser.add_argument("--defense")
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--batch", type=int, help="of all; else 1, and what is usual for evaluate")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=5)
    args = parser.parse_args()
    opened = gear.open_dataset(args.data)
    Part.wanted = args.samples
    dataset = Part(root=opened.root, plan=opened.plan, task=opened.task, manifest=opened.manifest)
    model = chosen_model(args.model, args.settings)
    guarded = GuardedModel(model, open_guard(Guard.of(args.defense), [model], opened.plan.task["name"]))
    pictures = [sample.images for sample in dataset[:]]
    step, batch = args.batch or 1, args.batch or guarded.usual_batch(dataset)
    groups = [range(i, min(i + step, len(pictures))) for i in range(0, len(pictures), step)]
    guarded.predict([pictures[i] for i in groups[0]], groups[0])
    print(f"{os.cpu_count()} cores, {len(pictures)} samples of {pictures[0]['left'].shape}, {batch} at a time")
    spent: dict[str, list[float]] = {"bare": [], "predict": [], "evaluate": []}
    batches = [as_batch([pictures[i] for i in group], tuple(pictures[0])) for group in groups]
    for _ in range(args.rounds):
        begun = time.perf_counter()
        with torch.inference_mode():
            for one in batches:
                guarded.model.forward(one)
        spent["bare"].append((time.perf_counter() - begun) / len(pictures))
        begun = time.perf_counter()
        for group in groups:
            guarded.predict([pictures[i] for i in group], group)
        spent["predict"].append((time.perf_counter() - begun) / len(pictures))
        with tempfile.TemporaryDirectory() as folder:
            scorer = Scorer(dataset, Path(folder), "row", (), model.found)
            begun = time.perf_counter()
            notes = evaluate_row(dataset, scorer, guarded, batch=batch, workers=args.workers, done=lambda: None).results
            scorer.finish(notes)
            spent["evaluate"].append((time.perf_counter() - begun) / len(pictures))
        print(", ".join(f"{name} {seconds[-1]:.3f} s" for name, seconds in spent.items()), flush=True)
    begun = time.perf_counter()
    gather(scorer.reports[TASK].make, [note.parts[TASK] for note in notes], leave_one_out(range(len(notes))))
    print(f"intervals of {len(notes)} samples: {time.perf_counter() - begun:.2f} s")
    for name in ("bare", "predict"):
        ratios = sorted(whole / one for whole, one in zip(spent["evaluate"], spent[name], strict=True))
        print(f"evaluate / {name}: median {ratios[len(ratios) // 2]:.3f} of {args.rounds}")


if __name__ == "__main__":
    main()
