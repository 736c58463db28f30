"""`gear.train`: trains a network on datasets of its task."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from gear.config.dump import to_plain
from gear.contracts.loggers import LoggedRun
from gear.contracts.specs import ModelSpec, TaskSpec
from gear.dataset.files import clear_scratch
from gear.dataset.guarded_paths import remove_files
from gear.dataset.locks import exclusive_lock
from gear.dataset.reading import scenes_of
from gear.dataset.store import check_output
from gear.measuring.appearance_hash import PLANNED, appearance_of
from gear.measuring.plugin_selection import Chosen, check_camera
from gear.measuring.run_log import FOLDER, RunLog, choose_logger
from gear.networks.runtime import device_of, prepare
from gear.plugins.build import blamed, find
from gear.plugins.catalogue import PluginEntry
from gear.plugins.text import one_line
from gear.readers import Kept, Samples, all_of, open_all
from gear.reporting.display import displayed
from gear.values.errors import GearError
from gear.values.progress import Callbacks, Progress, Warn
from gear.values.serial import Json
from gear.verbs.train.adversary import Adversary
from gear.verbs.train.checkpoint import TrainingState, begun_config
from gear.verbs.train.config import TrainConfig, read_config
from gear.verbs.train.curves import write_curves
from gear.verbs.train.data import TRAINING, VALIDATION, keep_some, spread
from gear.verbs.train.feed import Feed
from gear.verbs.train.loop import OnStep, Parts, Training
from gear.verbs.train.request import TrainRequest
from gear.verbs.train.results import WEIGHTS, Origin, command_of, known, metrics_of, packed, write_history
from gear.verbs.train.run_log import SAMPLES_FILE, TrainLog, write_samples
from gear.verbs.train.sizes import picture_scale, without_empty_margins
from gear.verbs.train.starting import (
    build_network,
    check_options,
    freeze_pretrained,
    load_initial_weights,
    picture_share,
    precision_of,
    resumes_without_init,
    sizes_note,
    with_scale,
)

GIGABYTE = 1e9
CHANGE_NOTHING = ("workers", "cache_gb", "device")
"""Config keys that may change when a training is resumed, because the weights do not depend on them."""

Paths = str | Path | Sequence[str | Path]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainReport:
    """The result of `gear.train`.

    Attributes:
        root: folder of the results.
        weights: path of the weights file; pass it to the network as the option `weights=FILE`.
        steps: number of steps over all runs.
        elapsed_s: time of all steps and validations in seconds.
        best_step: number of steps after which the saved weights were reached.
        metrics: validation metrics of the saved weights.
        metric: name of the metric by which the saved weights were chosen; "" for the loss.
    """

    root: Path
    weights: Path
    steps: int
    elapsed_s: float
    best_step: int
    metrics: dict[str, float]
    metric: str

    def summary(self) -> str:
        """Returns the result as one line of text."""
        name = self.metric or "loss"
        value = self.metrics.get(name, float("nan"))
        return (
            f"{self.weights}: {name} {value:.4f} after step {self.best_step} of {self.steps} "
            f"({self.elapsed_s / 60:.1f} minutes)"
        )


def train(
    task: str,
    model: str,
    data: Paths,
    *,
    out: str | Path,
    val: Paths = (),
    epochs: int | None = None,
    time_budget_s: float | None = None,
    batch: int | None = None,
    lr: float | None = None,
    seed: int | None = None,
    init: str | Path | None = None,
    precision: str | None = None,
    device: str | None = None,
    workers: int | None = None,
    adversarial: str | None = None,
    settings: Iterable[str] = (),
    allow_test_data: bool = False,
    log_to: str | None = None,
    log_settings: Iterable[str] = (),
    progress: bool = False,
    on_step: OnStep | None = None,
    on_progress: Progress | None = None,
    on_warning: Warn | None = None,
) -> TrainReport:
    """Trains a network; resumes an interrupted training in `out`, and does nothing if it is finished.

    The same seed, data and settings give the same weights on the CPU of one machine, with or without interruptions,
    unless the training has a time budget.

    Args:
        task: name of a task plugin.
        model: name of a model plugin that can do the task and be trained.
        data: roots of datasets, folders of roots, or `DIR:SPLIT`.
        out: folder of the results: `model.safetensors`, `train.json`, `card.md`, `curves.png`,
            `samples.jpg`.
        val: validation data; by default some sequences of `data` are held out.
        epochs, time_budget_s, batch, lr, seed, init, precision, device, workers: values of the config keys with these
            names (`lr` is `learning_rate`); None takes the network's default. `TrainConfig` describes the keys.
        adversarial: name of an attack plugin; training pictures then contain patches optimised against the network.
        settings: `KEY=VALUE` texts for any key of `TrainConfig`, such as `augmentation.flip=0`; options of the network
            are `options.KEY`.
        allow_test_data: whether `test` splits are accepted as training data.
        log_to: name of a logger plugin, such as `tensorboard`, which logs curves and figures in `out/log`; None for no
            log. The weights do not depend on it.
        log_settings: `KEY=VALUE` texts for the logger's options.
        progress: shows a progress bar.
        on_step: called after every step and every validation, with the state of the training.
        on_progress: called after every step; with a time budget the number of all steps is an estimate.
        on_warning: called with lines on values chosen for the time budget, and on settings that may be unintended.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    request = TrainRequest(
        task=task,
        model=model,
        data=as_texts(data),
        out=out,
        val=as_texts(val),
        epochs=epochs,
        time_budget_s=time_budget_s,
        batch=batch,
        lr=lr,
        seed=seed,
        init=init,
        precision=precision,
        device=device,
        workers=workers,
        adversarial=adversarial,
        settings=tuple(settings),
        allow_test_data=allow_test_data,
        log_to=log_to,
        log_settings=tuple(log_settings),
    )
    callbacks = Callbacks.of(on_progress=on_progress, on_warning=on_warning)
    with displayed(callbacks, "train", progress=progress, unit="step") as shown:
        return run_train(request, shown, on_step)


def run_train(request: TrainRequest, callbacks: Callbacks, on_step: OnStep | None = None) -> TrainReport:
    """Trains a network with the arguments in `request`, which `gear.train` describes.

    Args:
        request: arguments of the training.
        callbacks: progress and warnings.
        on_step: called after each step with the state, the finished share of the training (0..1) and the metrics of a
            validation; None for no calls.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    prepare()
    logger = choose_logger(request.log_to, request.log_settings)
    origin = _origin(request, callbacks)
    found, spec, root = origin.model, origin.spec, Path(request.out)
    title = f"{found.spec.name} on {request.task}"
    log = RunLog(logger, LoggedRun(verb="train", title=title, folder=root / FOLDER), callbacks.on_warning)
    parts = _parts(origin, root, callbacks, log)
    with exclusive_lock(root, callbacks.on_warning), contextlib.closing(log):
        clear_scratch(root)
        training = Training(
            parts, origin.config, on_step=with_progress(on_step, callbacks), pack=partial(packed, origin)
        )
        state = training.run()
        write_curves(root, spec, state, title)
        _write_samples(parts, callbacks.on_warning)
        write_history(root, origin, state)
        clear_scratch(root)
    best = next(entry for entry in state.validations if entry["step"] == state.best_step)
    return TrainReport(
        root=root,
        weights=root / WEIGHTS,
        steps=state.step,
        elapsed_s=state.elapsed_s,
        best_step=state.best_step,
        metrics=known(metrics_of(best)),
        metric=spec.metric,
    )


def _write_samples(parts: Parts, on_warning: Warn) -> None:
    """Writes the figure of validation samples with predictions by the final weights; a warning states that it cannot
    be drawn, and then there is no figure.
    """
    remove_files(parts.root, [SAMPLES_FILE])
    try:
        load_initial_weights(parts.found, parts.twin, str(parts.root / WEIGHTS))
        write_samples(parts.root, parts.task, parts.twin, parts.views, parts.validation)
    except Exception as error:  # a task or a network of another package
        on_warning(f"{parts.root}: no {SAMPLES_FILE} ({one_line(error)})")


def with_progress(on_step: OnStep | None, callbacks: Callbacks) -> OnStep:
    """Returns a step callback that also reports the progress; with a time budget, the number of all steps is an
    estimate.

    Args:
        on_step: the callback of the caller; None if it gave none.
        callbacks: callbacks that receive the numbers of finished and of all steps.
    """

    def report(state: TrainingState, share: float, metrics: dict[str, float] | None) -> None:
        callbacks.on_progress(state.step, max(state.step, round(state.step / share)) if share > 0 else 0)
        if on_step is not None:
            on_step(state, share, metrics)

    return report


def _origin(request: TrainRequest, callbacks: Callbacks) -> Origin:
    """Opens and checks everything that a request names, and chooses the settings that depend on the data."""
    found, task_found = find("model", request.model), find("task", request.task)
    config = read_config(trainable(found, request.task), request.config_values, request.config_settings)
    check_options(found, config)
    training, validation = _samples(request, config)
    spec = task_found.spec
    assert isinstance(spec, TaskSpec)
    for dataset in (*training.datasets, *validation.datasets):
        check_camera(Chosen(found=found, options=config.options), dataset)
        for keys in PLANNED:
            dataset.content(str, *keys)
    scale, precision = picture_scale(found, config, training), precision_of(found, config)
    if config.precision == "auto" and precision == "bfloat16":
        callbacks.on_warning(
            "steps run in bfloat16, in which this device is quicker; --precision float32 keeps them whole"
        )
    config = replace(config, picture_scale=scale, precision=precision)
    training, validation = replace(training, scale=scale), replace(validation, scale=scale)
    if scale < 1:
        callbacks.on_warning(
            f"pictures are shown at {scale:g} of their size; --set picture_scale=1 shows them whole, and takes longer"
        )
    if mixed := sizes_note(found, config, training):
        callbacks.on_warning(mixed)
    share, root = scale * picture_share(training, spec), Path(request.out)
    config = with_scale(found, without_empty_margins(config, training), share, begun_config(root))
    check_output(root, "train into a folder of its own")
    return Origin(
        model=found,
        spec=spec,
        task=request.task,
        config=config,
        training=training,
        validation=validation,
        command=command_of(
            request.task, request.model, request.data, request.val, request.command_flags, request.config_settings
        ),
        appearance=appearance_of(dataset.plan for dataset in training.datasets),
        picture_share=share,
    )


def trainable(plugin: PluginEntry, task: str) -> Any:
    """Returns the recipe (default hyperparameters) of a network, after checking that it can be trained for a task.

    Args:
        plugin: plugin of the network.
        task: name of the task.

    Raises:
        GearError: the network is for other tasks, or cannot be trained.
    """
    spec = plugin.spec
    assert isinstance(spec, ModelSpec)
    if task not in spec.tasks:
        raise GearError(f"model {spec.name!r} does {', '.join(spec.tasks)}, not {task}")
    if spec.recipe is None:
        raise GearError(f"model {spec.name!r} cannot be trained by gear: its plugin gives no recipe")
    return spec.recipe


def _parts(origin: Origin, root: Path, callbacks: Callbacks, log: RunLog) -> Parts:
    found, config = origin.model, origin.config
    model = build_network(found, config, precision=config.precision)
    started = (
        ""
        if resumes_without_init(found, config.init, begun_config(root))
        else load_initial_weights(found, model, config.init)
    )
    with blamed(found, "module"):
        freeze_pretrained(model, config.init)
    if started:
        callbacks.on_warning(started)
    twin = build_network(found, config, precision="float32")
    views = found.spec.views  # type: ignore[attr-defined]
    limit = config.cache_gb * GIGABYTE
    validation = Kept(origin.validation, limit / 4)
    training = Kept(origin.training, limit)
    with blamed(found, "module"):
        twin.module()
        weights = next(iter(model.module().parameters()), None)
    adversary = None
    if config.adversarial.attack:
        adversary = Adversary(
            origin.training,
            config.adversarial,
            task=origin.task,
            seed=config.seed,
            device=device_of(config.device),
            cache_bytes=int(limit / 4),
        )
    plan, task = _plan(origin), origin.training.datasets[0].task
    return Parts(
        spec=origin.spec,
        task=task,
        found=found,
        model=model,
        twin=twin,
        views=views,
        validation=validation,
        feed=Feed(
            training,
            config,
            views,
            None if adversary is None else adversary.change,
            device="cpu" if weights is None else weights.device,
        ),
        adversary=adversary,
        root=root,
        plan=plan,
        log=TrainLog(log, plan, origin.spec, task),
    )


def _plan(origin: Origin) -> Json:
    """Returns everything on which the weights depend, as JSON."""
    config: Any = to_plain(origin.config)
    for name in CHANGE_NOTHING:
        config.pop(name)
    return {
        "task": origin.task,
        "model": origin.model.full_name,
        "version": origin.model.owner.version,
        "config": config,
        "training": origin.training.facts(),
        "validation": origin.validation.facts(),
    }


def _samples(request: TrainRequest, config: TrainConfig) -> tuple[Samples, Samples]:
    """Returns the training samples and the validation samples."""
    task, allowed = request.task, request.allow_test_data
    training = all_of(open_all(request.data, task, names=TRAINING, allow_test_data=allowed))
    if request.val:
        held_out = all_of(open_all(request.val, task, names=VALIDATION, allow_test_data=allowed))
        streets = {scenes_of(one): one.root for one in training.datasets}
        for one in held_out.datasets:
            if scenes_of(one) in streets:
                raise GearError(
                    f"--val {one.root} shows the same streets as --data {streets[scenes_of(one)]}; give --val "
                    "another split, or leave it out"
                )
    else:
        training, held_out = keep_some(training, config.validation_share, config.seed)
    return training, spread(held_out, config.validation_samples)


def as_texts(paths: Paths) -> tuple[str, ...]:
    """Returns one path, or a sequence of paths, as a tuple of texts."""
    return (str(paths),) if isinstance(paths, (str, Path)) else tuple(str(path) for path in paths)
