"""`gear.train`: the whole verb as one call."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from gear.config.dump import to_plain
from gear.contracts.specs import ModelSpec, TaskSpec
from gear.dataset.files import clear_scratch
from gear.dataset.locks import alone_at_work
from gear.dataset.reading import scenes_of
from gear.dataset.store import check_output
from gear.measuring.appearance_hash import PLANNED, look_of
from gear.measuring.plugin_selection import Chosen, check_camera
from gear.networks.runtime import device_of, prepare
from gear.plugins.build import blamed, find
from gear.plugins.catalogue import PluginEntry
from gear.readers import Kept, Samples, all_of, open_all
from gear.values.errors import GearError
from gear.values.progress import Warn
from gear.values.serial import Json
from gear.verbs.train.adversary import Adversary
from gear.verbs.train.checkpoint import begun_config
from gear.verbs.train.config import TrainConfig, read_config
from gear.verbs.train.curves import write_curves
from gear.verbs.train.data import TRAINING, VALIDATION, keep_some, spread
from gear.verbs.train.feed import Feed
from gear.verbs.train.loop import OnStep, Parts, Training
from gear.verbs.train.results import WEIGHTS, Origin, command_of, known, metrics_of, packed, write_history
from gear.verbs.train.sizes import picture_scale, without_empty_margins
from gear.verbs.train.starting import (
    begin_with,
    build_network,
    check_options,
    go_on_from,
    goes_on_alone,
    picture_share,
    precision_of,
    sizes_note,
    with_scale,
)

GIGABYTE = 1e9
CHANGE_NOTHING = ("workers", "cache_gb", "device")
"""Settings with which a training may be taken up again that was begun with others."""

Paths = str | Path | Sequence[str | Path]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainReport:
    """What a training came to.

    Attributes:
        root: folder of the results.
        weights: the file, for `weights=FILE` of the network.
        steps: how many were made in all.
        elapsed_s: time that they took, with validations.
        best_step: after which the weights stood.
        metrics: of the validation of those weights.
        metric: name of the one that chose them; "" is the loss.
    """

    root: Path
    weights: Path
    steps: int
    elapsed_s: float
    best_step: int
    metrics: dict[str, float]
    metric: str

    def summary(self) -> str:
        """One line for a person."""
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
    on_step: OnStep | None = None,
    on_warning: Warn | None = None,
) -> TrainReport:
    """Trains a network; takes up again what was begun in `out`, and does nothing where it is finished.

    The same seed, data and settings give the same weights on the CPU of one machine, stopped and taken up again or not,
    unless time is the budget.

    Args:
        task: name of a task plugin.
        model: name of a model plugin that can do the task and be trained.
        data: roots of datasets, folders of roots, or `DIR:SPLIT`.
        out: folder of the results: `model.safetensors`, `train.json`, `card.md`, `curves.png`.
        val: data to validate on; by default some sequences of `data` are kept for it.
        epochs, time_budget_s, batch, lr, seed, init, precision, device, workers: as in `TrainConfig`, where `lr` is
            `learning_rate`; what is not given is as the network's recipe says.
        adversarial: name of an attack; see `Adversarial`.
        settings: further `KEY=VALUE` texts for any key of `TrainConfig`, such as `augmentation.flip=0`; the network's
            own options are `options.KEY`.
        allow_test_data: whether `test` splits may be learnt from.
        on_step: called after every step and every validation.
        noted: told what was chosen for the time that there is.

    Raises:
        GearError: anything that the user can put right; its text is one line.
    """
    prepare()
    given: dict[str, Any] = {
        "epochs": epochs, "time_budget_s": time_budget_s, "batch": batch, "learning_rate": lr, "seed": seed,
        "init": init, "precision": precision, "device": device, "workers": workers,
    }  # fmt: skip
    settings = tuple(settings)
    if adversarial is not None:
        settings = (f"adversarial.attack={adversarial}", *settings)
    found, task_found = find("model", model), find("task", task)
    recipe = trainable(found, task)
    config = read_config(recipe, given, settings)
    check_options(found, config)
    training, validation = _samples(_listed(data), _listed(val), task, config, allow_test_data)
    spec = task_found.spec
    assert isinstance(spec, TaskSpec)
    for dataset in (*training.datasets, *validation.datasets):
        check_camera(Chosen(found=found, options=config.options), dataset, "--set options.")
        for keys in PLANNED:
            dataset.content(str, *keys)
    scale = picture_scale(found, config, training)
    if on_warning is not None and config.precision == "auto" and precision_of(found, config) == "bfloat16":
        on_warning("steps run in bfloat16, in which this device is quicker; --precision float32 keeps them whole")
    config = replace(config, picture_scale=scale, precision=precision_of(found, config))
    training, validation = replace(training, scale=scale), replace(validation, scale=scale)
    if scale < 1 and on_warning is not None:
        on_warning(
            f"pictures are shown at {scale:g} of their size; --set picture_scale=1 shows them whole, and takes longer"
        )
    if on_warning is not None and (mixed := sizes_note(found, config, training)):
        on_warning(mixed)
    share = scale * picture_share(training, spec)
    root = Path(out)
    begun = begun_config(root)
    config = with_scale(found, without_empty_margins(config, training), share, begun)
    check_output(root, "train into a folder of its own")
    flags = {"epochs": epochs, "time_budget": _budget(time_budget_s), "batch": batch, "lr": lr, "seed": seed,
             "init": init, "precision": precision, "allow_test_data": allow_test_data}  # fmt: skip
    origin = Origin(
        model=found,
        task=task,
        config=config,
        training=training,
        validation=validation,
        command=command_of(task, model, _listed(data), _listed(val), flags, settings),
        look=look_of(dataset.plan for dataset in training.datasets),
        picture_share=share,
    )
    parts = _parts(found, spec, origin, root, on_warning, begun)
    with alone_at_work(root):
        clear_scratch(root)
        progress = Training(parts, config, on_step=on_step, pack=partial(packed, origin)).run()
        write_curves(root, spec, progress, f"{found.spec.name} on {task}")
        write_history(root, origin, progress)
        clear_scratch(root)
    best = next(entry for entry in progress.validations if entry["step"] == progress.best_step)
    return TrainReport(
        root=root,
        weights=root / WEIGHTS,
        steps=progress.step,
        elapsed_s=progress.elapsed_s,
        best_step=progress.best_step,
        metrics=known(metrics_of(best)),
        metric=spec.metric,
    )


def trainable(found: PluginEntry, task: str) -> Any:
    """The recipe of a network for a task.

    Raises:
        GearError: it does not do the task, or cannot be trained.
    """
    spec = found.spec
    assert isinstance(spec, ModelSpec)
    if task not in spec.tasks:
        raise GearError(f"model {spec.name!r} does {', '.join(spec.tasks)}, not {task}")
    if spec.recipe is None:
        raise GearError(f"model {spec.name!r} cannot be trained by gear: its plugin gives no recipe")
    return spec.recipe


def _parts(
    found: PluginEntry,
    spec: TaskSpec[Any],
    origin: Origin,
    root: Path,
    on_warning: Warn | None,
    begun: Json,
) -> Parts:
    config = origin.config
    model = build_network(found, config, precision=config.precision)
    told = "" if goes_on_alone(found, config.init, begun) else begin_with(found, model, config.init)
    with blamed(found, "module"):
        go_on_from(model, config.init)
    if told and on_warning is not None:
        on_warning(told)
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
    return Parts(
        spec=spec,
        task=origin.training.datasets[0].task,
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
        plan=_plan(origin),
    )


def _plan(origin: Origin) -> Json:
    """What the bytes of a training follow from."""
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


def _samples(
    data: Sequence[str], val: Sequence[str], task: str, config: TrainConfig, allow_test_data: bool
) -> tuple[Samples, Samples]:
    if not data:
        raise GearError("there are no data to train on; give --data DIR")
    training = all_of(open_all(data, task, names=TRAINING, allow_test_data=allow_test_data))
    if val:
        held_out = all_of(open_all(val, task, names=VALIDATION, allow_test_data=allow_test_data))
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


def _listed(paths: Paths) -> list[str]:
    return [str(paths)] if isinstance(paths, (str, Path)) else [str(path) for path in paths]


def _budget(seconds: float | None) -> str | None:
    """As the command takes it: every digit, no exponent, and nothing where epochs are counted."""
    return None if not seconds else f"{np.format_float_positional(seconds, trim='-')}s"
