"""`gear.attack_scenes`: one attack for each scene of several datasets, distributed over the workers of an engine."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from gear.contracts.executors import Executor, Needs, Outcome, Report
from gear.dataset.executors.calibrations import CalibrationReports
from gear.dataset.executors.engines import DEFAULT, open_executor
from gear.dataset.executors.jobs import JobNotes, carry_out_jobs, run_jobs, shared_folder
from gear.dataset.json_text import load_json
from gear.dataset.store import plan_of, splits_of
from gear.measuring.guard import Guard
from gear.networks.runtime import has_cuda
from gear.plugins.datasets import root_and_split, roots_of
from gear.reporting.display import displayed
from gear.values.errors import GearError
from gear.values.progress import Callbacks, PhaseProgress, Progress, Warn
from gear.verbs.attack.folder import NOTES, read_patches
from gear.verbs.attack.report import AttackReport
from gear.verbs.attack.request import AttackRequest
from gear.verbs.attack.run import Paths, as_tuple, run_attack

MOST_CHARACTERS = 100
"""Largest number of characters that a folder's name takes from the names of a town and a scene."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Engine:
    """The engine whose workers carry out attacks.

    Attributes:
        name: name of the engine, such as `processes`.
        address: address of the engine's cluster; None for the default one.
        workers: number of attacks at the same time.

    Raises:
        GearError: the number of workers is below 1.
    """

    name: str = DEFAULT
    address: str | None = None
    workers: int = 1

    def __post_init__(self) -> None:
        if self.workers < 1:
            raise GearError(f"engine_workers must be at least 1, got {self.workers}")

    def opened(self, gpus: int) -> Executor:
        """Returns the executor of this engine; a single worker of the default engine is this process.

        Args:
            gpus: number of graphics cards that the engine reserves for each worker, if it can.

        Raises:
            GearError: the engine cannot be used.
        """
        needs = Needs(silence_s=math.inf, gpus=gpus)
        return open_executor(self.name, workers=self.workers, backend="attack", address=self.address, needs=needs)


def attack_scenes(
    data: Paths,
    *,
    model: str | Sequence[str],
    out: str | Path,
    val: Paths = (),
    defense: str | None = None,
    defense_settings: Sequence[str] = (),
    calibration: str | Path | None = None,
    calibration_patched: str | Path | None = None,
    engine: str = DEFAULT,
    address: str | None = None,
    engine_workers: int = 1,
    progress: bool = False,
    on_progress: Progress | None = None,
    on_fit_progress: Progress | None = None,
    on_fit_phase: PhaseProgress | None = None,
    on_warning: Warn | None = None,
    **arguments: Any,
) -> dict[str, AttackReport]:
    """Optimises patches for each scene of several datasets; resumes an interrupted run.

    Datasets of the same scene, for example in several weathers, are attacked together. The patches of a scene are in
    the folder `out/<town>-<scene>`, as `gear.attack` writes it.

    Args:
        data: datasets with probes, or folders of datasets; `DIR:SPLIT` selects a split.
        model: name of a model plugin, or several names for attacks on all of them at once.
        out: folder of the patch folders.
        val: datasets for validation; each scene uses those of its own.
        defense, defense_settings, calibration, calibration_patched: defense that the attacks take into account, as in
            `gear.attack`.
        engine: name of the engine whose workers carry out the attacks.
        address: address of the engine's cluster: a Ray cluster, or a partition of SLURM.
        engine_workers: number of attacks at the same time. With more than one, a script needs
            `if __name__ == "__main__":`.
        progress: shows a progress bar.
        on_progress: called after every scene.
        on_fit_progress: called while a defense reads its calibration samples, for one scene at a time.
        on_fit_phase: called with (unit, done, total) during a phase of the calibration, such as training steps, if the
            defense reports its phases.
        on_warning: called with lines on settings that may be unintended, and on scenes that failed.
        **arguments: further arguments of `gear.attack`, the same for all scenes.

    Returns:
        The results by `<town>-<scene>`.

    Raises:
        GearError: an error that the user can correct; the message is one line. All other scenes were attacked.
    """
    arguments |= {name: tuple(arguments.get(name, ())) for name in ("settings", "model_settings", "log_settings")}
    request = AttackRequest(
        data=as_tuple(data),
        models=(model,) if isinstance(model, str) else tuple(model),
        out=out,
        val=as_tuple(val),
        guard=Guard.of(defense, defense_settings, calibration, calibration_patched),
        **arguments,
    )
    callbacks = Callbacks.of(
        on_progress=on_progress, on_fit_progress=on_fit_progress, on_fit_phase=on_fit_phase, on_warning=on_warning
    )
    with displayed(callbacks, "attack", progress=progress, unit="scene") as shown:
        return run_attack_scenes(request, Engine(name=engine, address=address, workers=engine_workers), shown)


def requests_of(request: AttackRequest) -> dict[str, AttackRequest]:
    """Returns one request for each scene, by `<town>-<scene>`.

    Raises:
        GearError: a dataset cannot be read, or a scene has no data for validation although others have.
    """
    data, val = _by_scene(request.data), _by_scene(request.val)
    for scene in (*val, *(data if val else ())):
        if scene not in data or scene not in val:
            lacking, given = ("--data", "--val") if scene not in data else ("--val", "--data")
            raise GearError(f"scene {scene} is in {given}, but not in {lacking}; give datasets of the same scenes")
    return {
        scene: replace(request, data=tuple(paths), val=tuple(val.get(scene, ())), out=Path(request.out) / scene)
        for scene, paths in data.items()
    }


def _by_scene(paths: Sequence[str | Path]) -> dict[str, list[str]]:
    """Returns the datasets at some paths by their scene, each as `DIR:SPLIT` or as a folder."""
    found: dict[str, list[str]] = {}
    for path in paths:
        folder, split = root_and_split(path)
        for root in roots_of(folder) or [folder]:
            info = plan_of(root, split or splits_of(root)[0]).info
            found.setdefault(folder_name(info.town, info.scene), []).append(f"{root}:{split}" if split else str(root))
    return found


def folder_name(town: str, scene: str) -> str:
    """Returns the name of a scene's patch folder: `<town>-<scene>` as one safe part of a path.

    Both texts come from a dataset, which may be a stranger's. If a character had to be replaced, or the name had to be
    cut, the first digits of its SHA-256 are appended, so names of different scenes stay different.

    Args:
        town: name of the town in the dataset.
        scene: name of the scene in the dataset.
    """
    name = f"{town}-{scene}"
    safe = re.sub(r"[^A-Za-z0-9_.+:-]", "_", name)[-MOST_CHARACTERS:].lstrip(".")
    digest = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()
    return safe if safe == name else f"{safe}-{digest[:8]}"


def run_attack_scenes(request: AttackRequest, engine: Engine, callbacks: Callbacks) -> dict[str, AttackReport]:
    """Runs one attack for each scene, as `attack_scenes` describes.

    Args:
        request: the arguments of `gear.attack`, with the data of all scenes.
        engine: the engine whose workers run the attacks, with their number.
        callbacks: callbacks that receive the number of finished scenes, and warnings.

    Returns:
        The results by `<town>-<scene>`.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    requests = requests_of(request)
    scenes = list(requests)
    was_made: dict[str, bool] = {}

    def report(outcome: Outcome) -> None:
        scene = scenes[outcome.index]
        if outcome.kind == "failed":
            callbacks.on_warning(f"{scene}: {outcome.error}")
            return
        assert isinstance(outcome.value, _Attacked)
        was_made[scene] = outcome.value.made
        for line in outcome.value.warnings:
            callbacks.on_warning(f"{scene}: {line}")
        callbacks.on_progress(len(was_made), len(scenes))

    callbacks.on_progress(0, len(scenes))
    devices = [setting.partition("=")[2] for setting in request.model_settings if setting.startswith("device=")]
    executor = engine.opened(gpus=int(has_cuda(devices[-1] if devices else None)))
    work = partial(attack_in_worker, tuple(requests.values()), str(Path.cwd()))
    notes = JobNotes(root=Path(request.out), names=scenes)
    failed = run_jobs(executor, work, range(len(scenes)), report, callbacks=callbacks, notes=notes)
    if failed:
        raise GearError(notes.summary(failed, "scenes"))
    return {
        scene: AttackReport(
            out=Path(one.out),
            patches=read_patches(Path(one.out)),
            facts=load_json(Path(one.out) / NOTES),
            made=was_made[scene],
        )
        for scene, one in requests.items()
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class _Attacked:
    """What a worker did for one scene.

    Attributes:
        made: whether it made the patches; False if they were there.
        warnings: warnings of the attack, one line each.
    """

    made: bool
    warnings: tuple[str, ...]


def attack_in_worker(
    requests: Sequence[AttackRequest], folder: str | None, indices: Iterator[int], report: Report
) -> None:
    """Carries out some attacks, one after the other; runs in a worker.

    Args:
        requests: one request for each scene.
        folder: current folder of the command; None if it is that of the worker.
        indices: positions of the scenes.
        report: called with the outcome of each scene.

    Raises:
        GearError: the folder of the command is not there on the worker's machine.
    """

    def call(index: int) -> _Attacked:
        warnings: list[str] = []
        calibrations = CalibrationReports(report=report, index=index)
        made = run_attack(requests[index], calibrations.callbacks(warnings.append)).made
        return _Attacked(made=made, warnings=tuple(warnings))

    with shared_folder(folder):
        carry_out_jobs(call, indices, report)
