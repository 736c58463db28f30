"""Makes patches. Each step is a gear command, so an interrupted call continues when it is made again."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from authoring.weights.patches.effect import read_again, read_effect
from authoring.weights.patches.install import PATCHES
from authoring.weights.patches.plan import PatchPlan
from gear.dataset.files import sha256, write_alone
from gear.dataset.json_text import dump_json, load_json
from gear.networks.options import SHIPPED
from gear.networks.shipped import resolve
from gear.plugins.build import find
from gear.values.errors import DatasetError, GearError
from gear.values.machine import cores
from gear.values.serial import Json, to_json

EFFECT, MINUTES = "effect.json", "minutes.json"

Gear = Callable[[Sequence[str]], None]
"""Runs one gear command; raises `GearError` with the command's error message."""

OnStep = Callable[[str], None]
"""Called with the name of each completed step."""


def gear_process(jobs: int = 1) -> Gear:
    """Returns a function that runs gear commands in separate processes.

    Args:
        jobs: number of commands that run at the same time; each process gets its share of the cores.
    """
    threads = max(1, cores() // jobs)
    environment = {"OMP_NUM_THREADS": str(threads), **os.environ}

    def run(arguments: Sequence[str]) -> None:
        command = [sys.executable, "-m", "gear.cli.main", *arguments]
        done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
        if done.returncode:
            lines = done.stderr.strip().splitlines() or [f"ended with {done.returncode}"]
            raise GearError(f"gear {arguments[0]}: {lines[-1].removeprefix('gear: ')}")

    return run


def make_patch(plan: PatchPlan, root: Path, gear: Gear, on_step: OnStep) -> Json:
    """Makes and measures the patch of one scene; a completed patch is only read.

    `root` gets the pictures, the folder of the patch, `evaluation`, `gap` and, at the end, `effect.json`.

    Args:
        plan: plan of the patch.
        root: folder of the scene.
        gear: runs a gear command.
        on_step: called after each step.

    Returns:
        The measured effect, see `read_effect`.

    Raises:
        GearError: a command failed.
    """
    recipe = {"plan": to_json(plan), "weights_sha256": weights_hash(plan)}
    if (root / EFFECT).is_file():
        there = load_json(root / EFFECT)
        if isinstance(there, dict) and there.get("recipe") == recipe and "effect" in there:
            return there["effect"]
    for step in plan.commands(root):
        begun = time.monotonic()
        try:
            gear(step.arguments)
        finally:
            spent = _minutes(root) | {step.name: _minutes(root).get(step.name, 0.0) + (time.monotonic() - begun) / 60}
            write_alone(root / MINUTES, dump_json(spent))
        on_step(step.name)
    effect = read_effect(plan, root, sum(_minutes(root).values()))
    write_alone(root / EFFECT, dump_json({"recipe": recipe, "effect": effect}))
    return effect


def measure_again(plan: PatchPlan, root: Path, gear: Gear, on_step: OnStep, patches: Path = PATCHES) -> Json:
    """Measures an installed patch against the shipped weights, and adds the result to its `effect.json` as `again`.

    Raises:
        GearError: a command failed, the patch is not installed, or its `effect.json` is damaged.
    """
    path = patches / plan.name / EFFECT
    effect = load_json(path)
    if not isinstance(effect, dict):  # checked at the start, not after minutes of measuring
        raise DatasetError(path, "does not hold the measured effect of a patch; make the patch again with --install")
    for step in plan.commands_again(root):
        gear(step.arguments)
        on_step(step.name)
    effect |= {"again": read_again(plan, root)}
    write_alone(path, dump_json(effect))
    return effect


def weights_hash(plan: PatchPlan) -> str | None:
    """Returns the SHA-256 of the network's weights file; None for random weights.

    Raises:
        GearError: the file does not exist.
    """
    if not hasattr(find("model", plan.model).spec.config(), "weights"):
        return None
    options = dict(text.split("=", 1) for text in plan.model_settings)
    path = resolve(options.get("weights", SHIPPED), plan.model)
    return None if path is None else sha256(path.read_bytes())


def _minutes(root: Path) -> dict[str, float]:
    path = root / MINUTES
    return load_json(path) if path.is_file() else {}
