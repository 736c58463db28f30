"""`gear.attack`: resolves, optimises, writes a patch folder."""

from __future__ import annotations

import contextlib
import importlib.metadata
import json
import shutil
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.numpy import load as from_bytes

from gear.attacking.objectives import default_objective
from gear.config.dump import to_plain
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.attacks import Budget, Patch
from gear.contracts.specs import AttackSpec
from gear.dataset.files import clear_scratch, explained, read_bytes, sha256
from gear.dataset.layout import GEAR
from gear.dataset.reading import Dataset
from gear.dataset.sidecar import dump_json, load_json
from gear.plugins.build import NO_OPTIONS, blamed, build, find
from gear.values.errors import DatasetError, GearError, PluginError
from gear.values.rng import derive_rng
from gear.values.serial import Json
from gear.verbs.attack.data import check_joined, scenes_of
from gear.verbs.attack.models import build_model, check_attack, choose_defense, choose_models
from gear.verbs.attack.outputs import as_picture, write_curves, write_patches, write_samples
from gear.verbs.attack.report import AttackReport
from gear.verbs.attack.scenes import Scenes
from gear.verbs.attack.watch import CHECKPOINT, Recorder
from gear.verbs.collect.patches import read_patch
from gear.verbs.evaluate.player import weights_digest
from gear.verbs.train.data import open_all, root_and_split

Progress = Callable[[int, int], None]
"""Called with (steps done, steps in all)."""

STEPS = 300
"""Where neither steps nor queries are given."""

AGAIN = "is gone, damaged or of other patches; --force makes them again"

TRAINING = ("train", "finetuning", "debug")
VALIDATION = ("val",)


VERIFY = "verify"
"""Folder of the rendered check, in that of the patches."""


def attack(
    data: str | Path | Sequence[str | Path],
    *,
    model: str | Sequence[str],
    out: str | Path,
    attack: str = "scene_specific",
    steps: int | None = None,
    queries: int | None = None,
    settings: Iterable[str] = (),
    model_settings: Iterable[str] = (),
    defense: str | None = None,
    defense_settings: Iterable[str] = (),
    val: str | Path | Sequence[str | Path] = (),
    every: int = 25,
    patience: int = 0,
    compositor: str = "transport",
    seed: int = 0,
    allow_tests: bool = False,
    force: bool = False,
    progress: Progress | None = None,
) -> AttackReport:
    """Makes patches for the surfaces of a scene; takes up again what was begun.

    Under `out` lie `patch_0.png`, … to print and to collect with (`gear collect --patch OUT`), their exact values in
    `patch.safetensors`, `attack.json` with everything that it was done with, and figures.

    Args:
        data: datasets with probes (`gear collect --probes`), of one task; several make one patch for all of them.
        model: name of a model plugin; several are attacked at once.
        out: the patch folder.
        attack: name of an attack plugin.
        steps: of optimisation, at most; 300 unless given, and without an end where queries are counted.
        queries: forward passes, for attacks without gradients.
        settings: `KEY=VALUE` texts for the attack's options.
        model_settings: for the models' options.
        defense: that the attack looks through.
        defense_settings: for its options.
        val: datasets on whose samples patches are judged; the best are kept.
        every: steps between two looks at them.
        patience: looks without a better one until the attack ends; 0 for never.
        compositor: `transport`, or `homography`, which needs no probes.
        seed: of everything that is drawn.
        allow_tests: whether `test` splits may be optimised on.
        force: start afresh where something else is.
        progress: told after every step.

    Raises:
        GearError: anything that the user can put right; its text is one line.
    """
    if (steps is not None and steps < 1) or every < 1 or patience < 0 or (queries is not None and queries < 1):
        raise GearError("steps, queries and every must be at least 1, patience at least 0")
    datasets = open_all(_list(data), _task_of(data), names=TRAINING, allow_tests=allow_tests)
    task = datasets[0].plan.task["name"]
    validation = open_all(_list(val), task, names=VALIDATION, allow_tests=allow_tests)
    check_joined([*datasets, *validation])
    chosen = choose_models([model] if isinstance(model, str) else list(model), model_settings, datasets[0])
    guard = choose_defense(defense, defense_settings, chosen, task)
    found, options = find("attack", attack), with_overrides(NO_OPTIONS, settings)
    config = read_node(found.spec.config, options, "")
    surfaces = len(datasets[0].sidecar(0).record.surfaces)
    spec = check_attack(found, chosen, task, surfaces, queries)
    compositor = _compositor(compositor, spec, [*datasets, *validation])
    if steps is None:
        steps = STEPS if queries is None else queries  # a step costs at least one
    if {scenes_of(one) for one in datasets} & {scenes_of(one) for one in validation}:
        raise GearError("--data and --val hold the same samples; give --val another split")
    product = build(found, options)
    network = build_model(chosen, guard)
    before = weights_digest(network)
    plan: Json = {
        "attack": {
            "name": found.spec.name,
            "package": found.owner.package,
            "version": found.owner.version,
            "options": to_plain(config),
        },
        "models": [one.facts() for one in chosen],
        "weights_sha256": before,
        "defense": None if guard is None else guard.facts(),
        "task": task,
        "data": [_facts(dataset) for dataset in datasets],
        "validation": [_facts(dataset) for dataset in validation],
        "compositor": compositor,
        "steps": steps,
        "queries": queries,
        "every": every,
        "patience": patience,
        "seed": seed,
    }
    root = Path(out)
    there = _begin(root, plan, force=force)
    if there is not None:
        return AttackReport(out=root, patches=_read_patches(root), facts=there, made=False)

    device = str(getattr(network, "device", "cpu"))
    seen, held = (Scenes(group, compositor, device) for group in (datasets, validation))
    # One each: an objective remembers the clean answers of its samples by their numbers.
    make = product.objective if hasattr(product, "objective") else default_objective
    used = product.settings(seen.samples[0]) if hasattr(product, "settings") else config
    objective, held_objective = make(seen.samples[0]), make(seen.samples[0])
    recorder = Recorder(
        root=root,
        key=_key(plan),
        steps=steps,
        judge=(lambda patches: held.harm(network, held_objective, patches)) if validation else None,
        every=every,
        patience=patience,
        queries=queries,
        told=progress,
    )
    recorder.tell(0)
    with blamed(found, "optimise"):
        last = product.optimise(
            network,
            seen.samples,
            seen.compositor,
            budget=Budget(steps=steps, queries=queries),
            rng=derive_rng(seed, "attack", found.spec.name),
            watch=recorder,
        )
    _check_patches(last, surfaces, f"{found.spec.name} ({found.owner.package} {found.owner.version})")
    if weights_digest(network) != before:
        raise PluginError(found.spec.name, "optimise", "the attack changed the model; nothing was written")
    if queries is not None and not recorder.curves:
        raise GearError(f"{queries} queries are too few for one step; give more with --queries N")
    done = 0 if spec.is_control else max((len(curve) for curve in recorder.curves.values()), default=steps)
    if not recorder.stopped:
        recorder.finish(done, last)
    patches = recorder.best or last
    seconds = recorder.clock()
    promised, kept = (0.0, 0.0) if spec.is_control else seen.masking(network, objective, patches)
    facts: Json = {
        "gear": importlib.metadata.version("mujoco-gear"),
        "torch": str(torch.__version__),
        **plan,
        "settings": to_plain(used),
        "steps_done": done,
        "seconds": round(seconds, 3),
        "steps_per_s": round(done / seconds, 4) if done and seconds else None,
        "stopped": recorder.stopped,
        "gradient": _gradient_facts(recorder.curves.get("gradient", [])),
        "masking": {"promised": promised, "kept": kept} if promised else None,
        "patches": {patch.name: sha256(as_picture(patch).tobytes()) for patch in patches},
        "curves": {name: [_plain(value) for value in curve] for name, curve in recorder.curves.items()},
        "validation_harm": [[step, _plain(harm)] for step, harm in recorder.judged],
    }
    write_curves(
        root, f"{attack} on {', '.join(one.found.spec.name for one in chosen)}", recorder.curves, recorder.judged
    )
    write_samples(root, seen.pairs(patches))
    write_patches(root, patches, facts)
    with contextlib.suppress(FileNotFoundError):
        (root / CHECKPOINT).unlink()
    clear_scratch(root)
    with contextlib.suppress(OSError):
        (root / GEAR).rmdir()
    return AttackReport(out=root, patches=tuple(patches), facts=facts, made=True)


def _begin(root: Path, plan: Json, *, force: bool) -> Json | None:
    """What is there already and whole, or nothing.

    Raises:
        DatasetError: something else is there, or the disk refuses.
    """
    finished = root / "attack.json"
    if force:
        with explained(root):
            for path in (finished, root / CHECKPOINT, *root.glob("patch_*.png")):
                path.unlink(missing_ok=True)
        shutil.rmtree(root / VERIFY, ignore_errors=True)  # what the patches that go did in the world
    if finished.exists():
        there = _read_notes(finished)
        if any(there.get(key) != json.loads(json.dumps(value)) for key, value in plan.items()):
            raise DatasetError(
                root, "holds patches that were made otherwise; use another --out, or --force to replace them"
            )
        _check_whole(root, there)
        return there
    with explained(root):
        root.mkdir(parents=True, exist_ok=True)
    return None


def _read_notes(path: Path) -> Json:
    try:
        there = json.loads(read_bytes(path))
    except ValueError:
        there = None
    if not isinstance(there, dict):
        raise DatasetError(path, AGAIN)
    return there


def _check_whole(root: Path, notes: Json) -> None:
    """Whether the pictures are those that the notes speak of.

    Raises:
        DatasetError: one is not, or is gone.
    """
    for name, digest in notes["patches"].items():
        path = root / f"{name}.png"
        if not path.is_file() or sha256(read_patch(path).tobytes()) != digest:
            raise DatasetError(path, AGAIN)


def _read_patches(root: Path) -> tuple[Patch, ...]:
    path = root / "patch.safetensors"
    try:
        arrays = from_bytes(path.read_bytes())
    except (OSError, SafetensorError) as error:
        raise DatasetError(path, AGAIN) from error
    return tuple(Patch(name=name, rgb=arrays[name]) for name in sorted(arrays))


def _compositor(name: str, spec: AttackSpec[Any], datasets: Sequence[Dataset[Any]]) -> str:
    """The one that is asked for; homography where transport lacks probes that the attack does not need.

    Raises:
        DatasetError: the attack needs them.
    """
    lacking = next((dataset for dataset in datasets if not dataset.plan.auxiliary), None)
    if name != "transport" or lacking is None:
        return name
    if spec.needs_probes:
        raise DatasetError(
            lacking.root, "has no probes; collect it with --probes, or attack with --compositor homography"
        )
    return "homography"


def _check_patches(patches: Any, surfaces: int, owner: str) -> None:
    """Raises `PluginError` where an attack returns something else than it promises."""
    names = [f"patch_{n}" for n in range(surfaces)]
    if not isinstance(patches, tuple) or not all(isinstance(patch, Patch) for patch in patches):
        raise PluginError(owner, "optimise", "must return a tuple of Patch")
    if [patch.name for patch in patches] != names:
        raise PluginError(owner, "optimise", f"must return {', '.join(names)}")
    for patch in patches:
        rgb = patch.rgb
        if rgb.dtype != np.float32 or rgb.ndim != 3 or rgb.shape[2] != 3 or not np.isfinite(rgb).all():
            raise PluginError(owner, "optimise", f"{patch.name} must be (H, W, 3) float32 without NaN")
        if rgb.min() < 0 or rgb.max() > 1:
            raise PluginError(owner, "optimise", f"{patch.name} leaves 0..1")


def _gradient_facts(norms: Sequence[float]) -> Json:
    known = [value for value in norms if np.isfinite(value)]
    if not known:
        return None
    return {"least": min(known), "median": float(np.median(known)), "zero_steps": sum(value == 0 for value in known)}


def _facts(dataset: Dataset[Any]) -> Json:
    info = dataset.plan.info
    return {
        "scene": f"{info.town}/{info.scene}",
        "split": info.split,
        "seed": info.seed,
        "weather": dataset.manifest["weather"]["name"],
        "samples": len(dataset),
        "content": dataset.plan.content_key,
        "sha256": sha256(dump_json(dataset.manifest["samples"])),
    }


def _task_of(data: str | Path | Sequence[str | Path]) -> str:
    """The task of the first dataset that the paths mean."""
    for path in _list(data):
        for plan in sorted(root_and_split(path)[0].glob("**/gear/*/plan.json")):
            return str(load_json(plan)["task"]["name"])
    raise DatasetError(str(next(iter(_list(data)), "")), "there is no dataset of gear's here")


def _list(paths: str | Path | Sequence[str | Path]) -> list[str | Path]:
    return [paths] if isinstance(paths, (str, Path)) else list(paths)


def _plain(value: float) -> float | None:
    return float(f"{value:.6g}") if np.isfinite(value) else None


def _key(plan: Json) -> str:
    return sha256(dump_json(plan))
