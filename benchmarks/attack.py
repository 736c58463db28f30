"""What an attack's step costs beside the network's own passes.

    python benchmarks/attack.py --model ddrnet23_slim --data data/b01 [--steps 10] [--set KEY=VALUE …]

A bare step is one forward pass and one backward pass to the pictures for every separately normalised term; the attack's
step does the same through textures, appearance, compositor and optimiser. Both are timed in turns in this process, on
the same network, batch and pictures, once every picture has been seen (what is worked out once a picture, such as what
the network says of it untouched, is not a step's); the ratio of the medians is printed. With `--set weights=none` no
weights are needed.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import time
from collections.abc import Callable
from functools import partial

import torch

from gear.compositor.base import CACHE_BYTES, Prepared
from gear.compositor.cache import Cache
from gear.config.overrides import with_overrides
from gear.contracts.models import Model
from gear.plugins.attacks.optimisation.frozen_model import frozen
from gear.plugins.attacks.optimisation.loop import PatchedBatch, Problem, TextureOptimiser, batch_of, unit_gradients
from gear.plugins.attacks.scene_specific import SceneSpecific, SceneSpecificConfig
from gear.plugins.build import NO_OPTIONS, build, find
from gear.readers import open_all
from gear.values.rng import derive_rng
from gear.verbs.attack.scenes import Scenes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", required=True)
    parser.add_argument("--data", required=True)
    parser.add_argument("--task", default="semseg")
    parser.add_argument("--batch", type=int, default=2)
    parser.add_argument("--steps", type=int, default=10)
    parser.add_argument("--set", action="append", default=[], dest="settings")
    args = parser.parse_args()
    model: Model = build(find("model", args.model), with_overrides(NO_OPTIONS, args.settings))
    datasets = open_all([args.data], args.task, names=("train", "debug"))
    scenes = Scenes(datasets, "transport", "cpu", Cache[Prepared](CACHE_BYTES))
    config = SceneSpecific(SceneSpecificConfig(batch=args.batch)).settings(scenes.samples[0])
    problem = Problem(model=model, dataset=scenes.samples, compositor=scenes.compositor, settings=config)
    objective = SceneSpecific(config).objective(scenes.samples[0])
    ascend = unit_gradients(problem, objective, config)
    optimiser = TextureOptimiser(problem.surfaces(), problem.settings, derive_rng(0, "benchmark"), None)

    def seen(step: int) -> PatchedBatch:
        textures = optimiser.parameters.clone().requires_grad_(True)
        indices = batch_of(step, len(scenes.samples), args.batch, optimiser.seed)
        return problem.compose_batch(textures, indices, step, optimiser.seed)

    def attack_step(step: int) -> int:
        textures = optimiser.parameters.clone().requires_grad_(True)
        indices = batch_of(step, len(scenes.samples), args.batch, optimiser.seed)
        direction, values = ascend(textures, problem.compose_batch(textures, indices, step, optimiser.seed))
        optimiser.step(direction, 1.0)
        return len(values)

    def bare_step(batch: PatchedBatch) -> int:
        views = {name: picture.detach().requires_grad_(True) for name, picture in batch.views.items()}
        outputs = model.forward(views) if args.task in ("semseg", "depth") else model.forward(views, batch.samples)
        terms = objective.terms(model, batch.views, batch.samples, batch.indices) if not counts else {}
        counts.append(counts[0] if counts else len(terms))
        for number in range(counts[0]):
            total = torch.stack([value.float().mean() for value in outputs.values()]).sum()
            torch.autograd.grad(total, list(views.values()), retain_graph=number + 1 < counts[0])
        return counts[0]

    counts: list[int] = []
    bare, whole = [], []
    with frozen(model):
        first = max(2, -(-len(scenes.samples) // args.batch))
        for step in range(first):
            attack_step(step)
        for step in range(first, first + args.steps + 1):
            batch = seen(step)
            one, other = timed(partial(bare_step, batch)), timed(partial(attack_step, step))
            if step > first:
                bare.append(one)
                whole.append(other)
    print(
        json.dumps(
            {
                "cores": os.cpu_count(),
                "threads": torch.get_num_threads(),
                "model": args.model,
                "batch": args.batch,
                "size": list(scenes.samples[0].images["left"].shape[:2]),
                "terms": counts[0],
                "bare_s": round(statistics.median(bare), 4),
                "attack_s": round(statistics.median(whole), 4),
                "ratio": round(statistics.median(whole) / statistics.median(bare), 3),
            }
        )
    )


def timed(run: Callable[[], int]) -> float:
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
