"""The paper's settings against gear's: what patches of the same scenes, pictures and steps do once they are rendered.

    python -m authoring.weights patches --task depth --model ddrnet23_slim_depth --out patches
    python benchmarks/attack_presets.py --task depth --model ddrnet23_slim_depth --model-set input_scale=1 \\
        --steps 120 --out presets patches/ddrnet23_slim_depth/*

`--attack NAME:KEY=VALUE:…`, repeatable, compares other attacks, or one with other options.

Takes the pictures of finished scenes (`train`, `val`, and `none`, which patches are judged on). Prints, for each scene
and attack, the task's metric of clean pictures, its change by the rendered patch, and the minutes of the attack; then
the mean change of each attack. What is finished is only read when it is called again.
"""

from __future__ import annotations

import argparse
import statistics
from pathlib import Path

import gear
from gear.contracts.specs import TaskSpec
from gear.dataset.json_text import load_json
from gear.plugins.build import find

ATTACKS = ["scene_specific", "carla_gear"]


def main() -> None:
    """Prints a line a scene and attack, then the means."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, help="one a scene")
    parser.add_argument("--task", required=True)
    parser.add_argument("--model", required=True)
    parser.add_argument("--steps", type=int, default=120)
    parser.add_argument("--attack", action="append", metavar="NAME:KEY=VALUE:…", help=f"({' '.join(ATTACKS)})")
    parser.add_argument("--metric", help="of the task's evaluator (the task's own)")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--model-set", action="append", default=[])
    args = parser.parse_args()
    spec = find("task", args.task).spec
    assert isinstance(spec, TaskSpec)
    metric = args.metric or spec.metric.rpartition(".")[2]
    print(f"{metric} over scenes; {args.steps} steps each")
    changes: dict[str, list[float]] = {attack: [] for attack in args.attack or ATTACKS}
    for folder in args.folders:
        for attack in changes:
            name, *settings = attack.split(":")
            out = args.out / f"{folder.name}-{attack.replace(':', '-')}"
            gear.attack(
                folder / "train", model=args.model, out=out / "patch", attack=name, steps=args.steps,
                settings=settings, model_settings=args.model_set, val=folder / "val",
            )  # fmt: skip
            found = gear.gap(
                folder / "none", patch=out / "patch", model=args.model, model_settings=args.model_set,
                compositors=("transport",), out=out / "gap",
            ).as_json()["effect"]  # fmt: skip
            changes[attack].append(found["rendered"][metric] - found["clean"][metric])
            minutes = load_json(out / "patch/attack.json")["seconds"] / 60
            print(
                f"{folder.name:24} {attack:40} clean {found['clean'][metric]:.3f}  change {changes[attack][-1]:+.3f}  "
                f"{minutes:.1f} min",
                flush=True,
            )
    for attack, found_changes in changes.items():
        print(f"mean {attack:40} {statistics.mean(found_changes):+.4f} over {len(found_changes)} scenes")


if __name__ == "__main__":
    main()
