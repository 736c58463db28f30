"""`gear.attack_drive`: optimises patches by what closed-loop drives do."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import cast

import torch

from gear.config.dump import to_plain
from gear.contracts.attacks import Budget, Patch
from gear.contracts.models import Model
from gear.contracts.specs import AttackSpec
from gear.dataset.files import sha256, write_whole
from gear.dataset.guarded_paths import remove_tree
from gear.dataset.json_text import dump_json
from gear.dataset.locks import exclusive_lock
from gear.driving.attacked_drives import (
    AttackedDrive,
    DriveObjective,
    PassThroughCompositor,
    PatchSurfaces,
    PlaceholderModel,
)
from gear.driving.drives import DriveRun
from gear.driving.worker import DriveWorker, single_thread
from gear.formats.png import encode_rgb
from gear.measuring.patch_checks import check_patches
from gear.plugins.build import blamed, build, find
from gear.reporting.display import displayed
from gear.values.errors import GearError
from gear.values.progress import Callbacks, PhaseProgress, Progress, Warn
from gear.values.rng import derive_rng
from gear.values.serial import Json
from gear.verbs.attack.achieved import plain
from gear.verbs.attack.drives.held_out import evaluate_held_out
from gear.verbs.attack.drives.job import HELD_OUT, DriveJob, placed_runs, resolve_drives
from gear.verbs.attack.drives.request import DriveAttackRequest
from gear.verbs.attack.drives.rounds import ROUNDS, Rounds
from gear.verbs.attack.folder import begin, read_patches, tidy
from gear.verbs.attack.monitor import Recorder
from gear.verbs.attack.outputs import as_picture, write_curves, write_patches
from gear.verbs.attack.report import AttackReport


def attack_drive(
    drive: str | Path,
    *,
    out: str | Path,
    driver: str | None = None,
    drive_settings: Iterable[str] = (),
    attack: str = "square",
    queries: int = 100,
    steps: int = 300,
    redrive: int = 100,
    frames: int = 60,
    settings: Iterable[str] = (),
    held_out: int = 3,
    seed: int = 0,
    device: str | None = None,
    force: bool = False,
    progress: bool = False,
    on_progress: Progress | None = None,
    on_fit_progress: Progress | None = None,
    on_fit_phase: PhaseProgress | None = None,
    on_warning: Warn | None = None,
) -> AttackReport:
    """Optimises patches by what closed-loop drives do: by crashes, times to collision and distances, or by braking for
    nothing on a free road. Resumes an interrupted run.

    An attack without gradients tries a patch, drives a batch of the config's situations with it, and keeps what makes
    the drives worse (`gear.driving.severity`). An attack with gradients optimises on frames of the drives, and drives
    anew every `redrive` steps. At the end, held-out seeds are driven without a patch, with a random patch and with the
    result.

    The folder `out` gets `patch_0.png`, …, `patch.safetensors`, `attack.json`, `figures/`, and the held-out drives.

    Args:
        drive: name or path of a drive config with one scene.
        out: the patch folder.
        driver: name of the attacked driver; None for the only driver with cameras.
        drive_settings: `KEY=VALUE` texts for any key of the drive config.
        attack: name of an attack plugin.
        queries: largest number of queries, for attacks without gradients; a query drives one batch of situations
            (option `batch` of the attack).
        steps: number of optimisation steps, for attacks with gradients.
        redrive: number of steps after which the situations are driven anew, for attacks with gradients.
        frames: number of frames of the drives on which the attack optimises until the next drives.
        settings: `KEY=VALUE` texts for the attack's options.
        held_out: number of seeds per situation at which the result is compared with no patch and a random one.
        seed: seed of the attack's random draws.
        device: device of the driver's network; overrides the config.
        force: whether patches and results of an earlier attack in `out` are deleted first.
        progress: shows a progress bar.
        on_progress: called after every query or step with the used and the allowed number, after every frame of a new
            round, and after every held-out drive.
        on_fit_progress: called after every calibration sample that the driver's defense reads for the first time.
        on_fit_phase: called with (unit, done, total) after every step of a phase of the calibration, such as a training
            step, if the defense reports its phases.
        on_warning: called with lines on drives that could not be made.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    request = DriveAttackRequest(
        drive=drive,
        out=out,
        drive_settings=tuple(drive_settings),
        driver=driver,
        attack=attack,
        queries=queries,
        steps=steps,
        redrive=redrive,
        frames=frames,
        settings=tuple(settings),
        held_out=held_out,
        seed=seed,
        device=device,
        force=force,
    )
    callbacks = Callbacks.of(
        on_progress=on_progress, on_fit_progress=on_fit_progress, on_fit_phase=on_fit_phase, on_warning=on_warning
    )
    with displayed(callbacks, "attack", progress=progress, unit=unit_of_drives(request)) as shown:
        return run_attack_drive(request, shown)


def unit_of_drives(request: DriveAttackRequest) -> str:
    """Returns the unit that the progress of an attack counts: `query`, or `step` for attacks with gradients."""
    spec = find("attack", request.attack).spec
    return "step" if isinstance(spec, AttackSpec) and spec.needs_gradients else "query"


def run_attack_drive(request: DriveAttackRequest, callbacks: Callbacks) -> AttackReport:
    """Runs an attack on the closed loop with the arguments in `request`, which `gear.attack_drive` describes. A
    finished attack with the same inputs is not run again.

    Args:
        request: the arguments.
        callbacks: callbacks that receive progress and warnings.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    job, root = resolve_drives(request), Path(request.out)
    worker = DriveWorker(drives=job.drives, callbacks=callbacks)
    with exclusive_lock(root, callbacks.on_warning):
        with worker.open_places, single_thread(job.drives):
            runs = placed_runs(job, worker, callbacks.on_warning)
            model = worker.model_of(job.drives.casts[job.label])
            plan = job.plan(runs, None if model is None else model.weights_sha256)
            there = begin(root, plan, force=request.force)
            if there is not None:
                return AttackReport(out=root, patches=read_patches(root), facts=there, made=False)
            if request.force:
                remove_tree(root, HELD_OUT)
                remove_tree(root, ROUNDS)
            patches, recorder = _optimised(job, runs, worker, plan, callbacks.on_progress)
        write_curves(root, f"{request.attack} on drives of {job.label}", recorder.curves, ())
        for patch in patches:
            write_whole(root, f"{patch.name}.png", encode_rgb(as_picture(patch)))
        facts = _facts(job, plan, patches, recorder)
        held_out = job.held_out()
        facts["held_out"] = None if held_out is None else evaluate_held_out(held_out, callbacks)
        write_patches(root, patches, facts)
        tidy(root)
    return AttackReport(out=root, patches=patches, facts=facts, made=True)


def _optimised(
    job: DriveJob, runs: Sequence[DriveRun], worker: DriveWorker, plan: Json, on_progress: Progress
) -> tuple[tuple[Patch, ...], Recorder]:
    """Runs the attack and checks its result.

    Returns:
        The patches, and the monitor of the attack.

    Raises:
        PluginError: the attack breaks its contract.
        GearError: the queries do not suffice for one step, or a drive cannot be made.
    """
    request, spec = job.request, job.spec
    recorder = Recorder(
        root=Path(request.out),
        key=sha256(dump_json(plan)),
        steps=request.steps if spec.needs_gradients else request.queries,
        queries=None if spec.needs_gradients else request.queries,
        on_progress=on_progress,
    )
    recorder.tell(0)
    if spec.needs_gradients:
        rounds = Rounds(job=job, worker=worker, runs=runs, recorder=recorder, on_progress=on_progress)
        patches = rounds.optimised()
    else:
        patches = _queried(job, runs, worker, recorder)
    check_patches(patches, job.surfaces, job.found)
    if recorder.is_asked and not recorder.done:
        raise GearError(f"{request.queries} queries are too few for one step; give more with --queries N")
    return patches, recorder


def _queried(job: DriveJob, runs: Sequence[DriveRun], worker: DriveWorker, recorder: Recorder) -> tuple[Patch, ...]:
    """The patches of an attack without gradients."""
    session, queries = worker.place_of(runs[0]).session, job.request.queries
    assert session is not None, "only drivers with cameras are attacked"
    record = PatchSurfaces(surfaces=tuple(face.name for face in session.world.faces))
    objective = DriveObjective(worker=worker)
    samples = [AttackedDrive(run=run, record=record, objective=objective) for run in runs]
    with blamed(job.found, "optimise"):
        patches: tuple[Patch, ...] = build(job.found, job.options).optimise(
            cast(Model, PlaceholderModel()),
            samples,
            PassThroughCompositor(surfaces=record.surfaces),
            budget=Budget(steps=queries, queries=queries),
            rng=derive_rng(job.request.seed, "attack", job.spec.name),
            monitor=recorder,
        )
    return patches


def _facts(job: DriveJob, plan: Json, patches: tuple[Patch, ...], recorder: Recorder) -> Json:
    """The content of `attack.json`, without the held-out drives."""
    seconds = recorder.clock()
    return {
        "gear": importlib.metadata.version("mujoco-gear"),
        "torch": str(torch.__version__),
        **plan,
        "settings": to_plain(job.settings),
        "steps_done": recorder.done,
        "seconds": round(seconds, 3),
        "steps_per_s": round(recorder.done / seconds, 4) if recorder.done and seconds else None,
        "stopped": recorder.stopped,
        "gradient": None,
        "gradient_check": None,
        "patches": {patch.name: sha256(as_picture(patch).tobytes()) for patch in patches},
        "curves": {name: [plain(value) for value in curve] for name, curve in recorder.curves.items()},
        "achieved": None,
        "validation_harm": [],
    }
