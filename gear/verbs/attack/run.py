"""`gear.attack`: checks the inputs, optimises patches and writes a patch folder."""

from __future__ import annotations

import contextlib
import importlib.metadata
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from gear.compositor.base import CACHE_BYTES, Prepared
from gear.compositor.cache import Cache
from gear.config.dump import to_plain
from gear.contracts.attacks import Budget, Objective, Patch, WithObjective, WithTaskOptions
from gear.contracts.defenses import ReportsFit
from gear.contracts.loggers import LoggedRun
from gear.contracts.models import Model
from gear.dataset.files import sha256
from gear.dataset.json_text import dump_json
from gear.dataset.locks import exclusive_lock
from gear.measuring.guard import Guard
from gear.measuring.guarded_model import weights_digest
from gear.measuring.patch_checks import check_patches
from gear.measuring.run_log import FOLDER, RunLog, choose_logger
from gear.measuring.shown_size import size_note
from gear.plugins.attacks.optimisation.model_group import Defended, device_name, members_of
from gear.plugins.attacks.optimisation.objectives import default_objective
from gear.plugins.build import blamed, build, traced
from gear.plugins.catalogue import PluginEntry
from gear.plugins.text import one_line
from gear.reporting.display import displayed
from gear.values.errors import GearError, PluginError
from gear.values.progress import Callbacks, PhaseProgress, Progress, Warn
from gear.values.rng import derive_rng
from gear.values.serial import Json
from gear.verbs.attack.achieved import MOST_SAMPLES, compared, plain
from gear.verbs.attack.folder import begin, read_patches, tidy
from gear.verbs.attack.job import Job, resolve
from gear.verbs.attack.models import build_model
from gear.verbs.attack.monitor import Recorder
from gear.verbs.attack.outputs import as_picture, write_curves, write_patches, write_samples
from gear.verbs.attack.report import AttackReport
from gear.verbs.attack.request import AttackRequest
from gear.verbs.attack.run_log import AttackLog, figure_of
from gear.verbs.attack.scenes import Scenes

Paths = str | Path | Sequence[str | Path]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Made:
    """The result of an optimisation.

    Attributes:
        patches: the best patches in validation, or the last ones without validation.
        settings: settings of the attack, completed with the task's values.
        optimised_on: samples on which the patches were optimised.
        objective: the objective that was maximised.
        held, held_objective: validation samples and the objective on them.
        recorder: monitor of the attack.
        steps_done: number of steps.
    """

    patches: tuple[Patch, ...]
    settings: Any
    optimised_on: Scenes
    objective: Objective
    held: Scenes
    held_objective: Objective
    recorder: Recorder
    steps_done: int


def attack(
    data: Paths,
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
    calibration: str | Path | None = None,
    calibration_patched: str | Path | None = None,
    val: Paths = (),
    every: int = 25,
    patience: int = 0,
    compositor: str = "transport",
    seed: int = 0,
    score_weight: float = 1.0,
    mask_weight: float = 1.0,
    allow_test_data: bool = False,
    force: bool = False,
    log_to: str | None = None,
    log_settings: Iterable[str] = (),
    progress: bool = False,
    on_progress: Progress | None = None,
    on_fit_progress: Progress | None = None,
    on_fit_phase: PhaseProgress | None = None,
    on_warning: Warn | None = None,
) -> AttackReport:
    """Optimises adversarial patches for the surfaces of a scene; resumes an interrupted run.

    The folder `out` gets `patch_0.png`, … for printing and for `gear collect --patch OUT`, the exact values in
    `patch.safetensors`, `attack.json` with all inputs and results, and figures.

    Args:
        data: datasets with probes (`gear collect --probes`), all of one task; with several datasets, the same patches
            are optimised for all of them.
        model: name of a model plugin, or several names for an attack on all of them at once.
        out: the patch folder.
        attack: name of an attack plugin.
        steps: largest number of optimisation steps; 300 by default, and unlimited if `queries` is given.
        queries: largest number of forward passes, for attacks without gradients.
        settings: `KEY=VALUE` texts for the attack's options.
        model_settings: `KEY=VALUE` texts for the models' options.
        defense: name of a defense plugin that the attack takes into account.
        defense_settings: `KEY=VALUE` texts for the defense's options.
        calibration: dataset without patches on which the defense is calibrated.
        calibration_patched: the calibration dataset rendered with patches.
        val: datasets for validation; the result is the patches with the largest objective on these datasets.
        every: number of steps between two validations.
        patience: number of validations without improvement after which the attack ends; 0 for never.
        compositor: method that puts patches into pictures: `transport`, or `homography`, which needs no probes.
        seed: seed of all random draws.
        score_weight: weight of the term that lowers the defense's score; 0 for no such term.
        mask_weight: weight of the term that lowers the defense's mask on the patch; 0 for no such term.
        allow_test_data: whether `test` splits are accepted as training data.
        force: whether patches and results of an earlier attack in `out` are deleted first.
        log_to: name of a logger plugin, such as `tensorboard`, which logs curves and figures in `out/log`; None for no
            log. The patches do not depend on it.
        log_settings: `KEY=VALUE` texts for the logger's options.
        progress: shows a progress bar.
        on_progress: called after every step with the finished and the allowed steps, or queries if these are limited.
        on_fit_progress: called after every calibration sample that the defense reads for the first time.
        on_fit_phase: called with (unit, done, total) after every step of a phase of the calibration, such as a training
            step, if the defense reports its phases.
        on_warning: called before the attack with lines on settings that may be unintended, such as pictures of another
            size than the model was trained on, or doubtful calibration data.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    request = AttackRequest(
        data=as_tuple(data),
        models=(model,) if isinstance(model, str) else tuple(model),
        out=out,
        attack=attack,
        steps=steps,
        queries=queries,
        settings=tuple(settings),
        model_settings=tuple(model_settings),
        guard=Guard.of(defense, defense_settings, calibration, calibration_patched),
        val=as_tuple(val),
        every=every,
        patience=patience,
        compositor=compositor,
        seed=seed,
        score_weight=score_weight,
        mask_weight=mask_weight,
        allow_test_data=allow_test_data,
        force=force,
        log_to=log_to,
        log_settings=tuple(log_settings),
    )
    callbacks = Callbacks.of(
        on_progress=on_progress, on_fit_progress=on_fit_progress, on_fit_phase=on_fit_phase, on_warning=on_warning
    )
    with displayed(callbacks, "attack", progress=progress, unit=unit_of(request)) as shown:
        return run_attack(request, shown)


def unit_of(request: AttackRequest) -> str:
    """Returns the unit that the progress of an attack with the arguments `request` counts: `query` if forward passes
    are limited, otherwise `step`.
    """
    return "step" if request.queries is None else "query"


def run_attack(request: AttackRequest, callbacks: Callbacks) -> AttackReport:
    """Runs an attack with the arguments in `request`, which `gear.attack` describes. The patches are written into the
    folder `request.out`; a finished attack with the same inputs is not run again.

    Args:
        request: the arguments.
        callbacks: callbacks that receive progress and warnings.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    logger = choose_logger(request.log_to, request.log_settings)
    job = resolve(request, callbacks)
    _warn(job, callbacks.on_warning)
    product, root = build(job.found, job.options), Path(request.out)
    network = build_model(job.models, job.guard, job.seed, job.weights)
    plan = job.plan(weights_digest(network), product)
    with exclusive_lock(root, callbacks.on_warning):
        there = begin(root, plan, force=request.force)
        if there is not None:
            if logger is not None:
                callbacks.on_warning(f"{root}: the patches were there already, so that nothing is logged")
            return AttackReport(out=root, patches=read_patches(root), facts=there, made=False)
        names = ", ".join(one.found.spec.name for one in job.models)
        title = f"{request.attack} on {names}"
        run = LoggedRun(verb="attack", title=title, folder=root / FOLDER)
        log = RunLog(logger, run, callbacks.on_warning)
        with contextlib.closing(log), traced(_asked(job), "forward"):
            calibration_s, fits = _calibrated(network, callbacks.on_warning)
            made = _optimised(job, product, network, plan, callbacks.on_progress, log)
            callbacks.part("measuring what the patches achieve")
            facts = _facts(job, network, plan, made) | {
                "calibration_seconds": round(calibration_s, 3),
                "defense_fit": fits,
            }
            write_curves(root, title, made.recorder.curves, made.recorder.judged)
            _write_figure(job, network, made, root, callbacks.on_warning)
            write_patches(root, made.patches, facts)
            tidy(root)
            if made.recorder.log is not None:
                made.recorder.log.finish(made.steps_done, made.patches, facts["achieved"])
    return AttackReport(out=root, patches=made.patches, facts=facts, made=True)


def as_tuple(paths: Paths) -> tuple[str | Path, ...]:
    """Returns one path, or a sequence of paths, as a tuple."""
    return (paths,) if isinstance(paths, (str, Path)) else tuple(paths)


def _warn(job: Job, on_warning: Warn) -> None:
    """Warns if the pictures have another size than those a model was trained on, or if the calibration data are
    doubtful.
    """
    sizes = (size_note(model, job.datasets[0]) for model in job.models)
    for note in (*sizes, *job.guard.calibration.doubts()):
        if note is not None:
            on_warning(note)


def _asked(job: Job) -> list[PluginEntry]:
    """Returns the plugins whose code runs in the attack, for error messages."""
    return [one.found for one in (*job.models, job.guard.defense) if one is not None]


def _write_figure(job: Job, network: Model, made: _Made, root: Path, on_warning: Warn) -> None:
    """Writes the figure of samples with predictions; a task or a network that cannot draw them gets a warning."""
    try:
        figure = figure_of(job.datasets[0].task, network, made.optimised_on, made.patches)
    except Exception as error:  # a task or a network of another package
        on_warning(f"{root}: no figure of samples ({one_line(error)})")
    else:
        write_samples(root, figure)


def _optimised(job: Job, product: Any, network: Model, plan: Json, on_progress: Progress, log: RunLog) -> _Made:
    """Runs the attack in the folder of its log, and checks its result.

    Raises:
        PluginError: the attack breaks its contract.
        GearError: there are no samples.
    """
    cache, device = Cache[Prepared](CACHE_BYTES), device_name(network)
    optimised_on, held = (Scenes(group, job.compositor, device, cache) for group in (job.datasets, job.validation))
    if job.spec.needs_gradients:
        optimised_on.check_adaptive(network, job.surfaces, derive_rng(job.seed, "adaptive"))
    # Two objectives, because each caches the clean predictions of its samples by their index.
    make = product.objective if isinstance(product, WithObjective) else default_objective
    settings = product.settings(optimised_on.samples[0]) if isinstance(product, WithTaskOptions) else job.config
    objective, held_objective = make(optimised_on.samples[0]), make(optimised_on.samples[0])
    recorder = Recorder(
        root=log.root,
        key=sha256(dump_json(plan)),
        steps=job.steps,
        judge=(lambda patches: held.harm(network, held_objective, patches)) if job.validation else None,
        every=job.every,
        patience=job.patience,
        queries=job.queries,
        on_progress=on_progress,
        log=AttackLog(
            log,
            config=plan,
            every=job.every,
            network=network,
            scenes=held if job.validation else optimised_on,
            task=job.datasets[0].task,
        ),
    )
    recorder.tell(0)
    with blamed(job.found, "optimise"), traced(_asked(job), "forward"):
        last = product.optimise(
            network,
            optimised_on.samples,
            optimised_on.compositor,
            budget=Budget(steps=job.steps, queries=job.queries),
            rng=derive_rng(job.seed, "attack", job.spec.name),
            monitor=recorder,
        )
    for patches in (last, recorder.best or last):
        check_patches(patches, job.surfaces, job.found)
    if weights_digest(network) != plan["weights_sha256"]:
        raise PluginError(job.spec.name, "optimise", "the attack changed the model; nothing was written")
    if job.queries is not None and recorder.is_asked and not recorder.done:
        raise GearError(f"{job.queries} queries are too few for one step; give more with --queries N")
    done = 0 if job.spec.is_control else recorder.done or job.steps
    if not recorder.stopped:
        recorder.finish(done, last)
    return _Made(
        patches=recorder.best or last,
        settings=settings,
        optimised_on=optimised_on,
        objective=objective,
        held=held,
        held_objective=held_objective,
        recorder=recorder,
        steps_done=done,
    )


def _calibrated(network: Model, on_warning: Warn) -> tuple[float, Json]:
    """Calibrates the defenses before the first step, so the time of the steps does not include the calibration.

    Returns:
        Seconds of the calibration, and by model the report of its defense on the calibration, if the defense returns
        one.
    """
    begun, fits = time.monotonic(), {}
    for name, member in members_of(network).items():
        state = member.calibrate() if isinstance(member, Defended) else None
        if isinstance(state, ReportsFit):
            report = state.fit_report()
            fits[name.rstrip("/")] = {"values": dict(report.values), "problems": list(report.problems)}
            for problem in report.problems:
                on_warning(f"WARNING: {problem}")
    return time.monotonic() - begun, fits


def _facts(job: Job, network: Model, plan: Json, made: _Made) -> Json:
    """Returns the content of `attack.json`."""
    recorder, done = made.recorder, made.steps_done
    seconds = recorder.clock()
    predicted, measured = (
        (0.0, 0.0) if job.spec.is_control else made.optimised_on.gradient_check(network, made.objective, made.patches)
    )
    return {
        "gear": importlib.metadata.version("mujoco-gear"),
        "torch": str(torch.__version__),
        **plan,
        "settings": to_plain(made.settings),
        "steps_done": done,
        "seconds": round(seconds, 3),
        "steps_per_s": round(done / seconds, 4) if done and seconds else None,
        "stopped": recorder.stopped,
        "gradient": _gradient_facts(recorder.curves.get("gradient", [])),
        "gradient_check": (
            {"predicted_change": predicted, "measured_change": measured}
            if predicted and np.isfinite([predicted, measured]).all()
            else None
        ),
        "patches": {patch.name: sha256(as_picture(patch).tobytes()) for patch in made.patches},
        "curves": {name: [plain(value) for value in curve] for name, curve in recorder.curves.items()},
        "achieved": None if job.spec.is_control else _achieved(job, network, made),
        "validation_harm": [[step, plain(harm)] for step, harm in recorder.judged],
    }


def _achieved(job: Job, network: Model, made: _Made) -> Json:
    """Returns the objective with random patches and with the optimised patches, on training samples and on
    validation samples.
    """
    found = {
        "training": compared(made.optimised_on, network, made.objective, made.patches, job.seed, MOST_SAMPLES),
        "validation": None,
    }
    if job.validation:
        found["validation"] = compared(made.held, network, made.held_objective, made.patches, job.seed)
    return found


def _gradient_facts(norms: Sequence[float]) -> Json:
    known = [value for value in norms if np.isfinite(value)]
    if not known:
        return None
    return {"least": min(known), "median": float(np.median(known)), "zero_steps": sum(value == 0 for value in known)}
