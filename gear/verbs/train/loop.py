"""The training loop: steps, validations and checkpoints, in an order that depends only on the seed and the data."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import nn

from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Task
from gear.dataset.files import sha256
from gear.networks.runtime import autocast, device_of, seeded
from gear.plugins.build import blamed
from gear.plugins.catalogue import PluginEntry
from gear.readers import Batch
from gear.values.errors import GearError
from gear.values.rng import derive_rng
from gear.values.serial import Json
from gear.verbs.train import checkpoint
from gear.verbs.train.adversary import Adversary
from gear.verbs.train.checkpoint import TrainingState
from gear.verbs.train.config import TrainConfig
from gear.verbs.train.feed import Feed
from gear.verbs.train.optimise import Buffers, RunningMean, clip_gradients, optimiser_of, rate_share
from gear.verbs.train.results import check_kept, is_kept, write_weights
from gear.verbs.train.run_log import TrainLog
from gear.verbs.train.validate import rank, total, validate

NOTE_EVERY = 10
"""Number of steps whose mean loss is one entry of the history."""

CHECKPOINT_EVERY_S = 120.0
VALIDATION_SHARE = 0.1
"""Largest share of the training time that validations take if there is a time budget."""

MOST_VALIDATIONS = 8
"""Largest number of validations of a training with a time budget."""

MOST_BROKEN_STEPS = 20

ONE_VALUE = "more than 1 value per channel"
"""Part of torch's error message for batch normalisation with only one value per channel."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Parts:
    """The objects that a training works with.

    Attributes:
        spec, task: spec of the task, and the task, which supplies the evaluator.
        found: plugin of the network.
        model: the network that is trained.
        twin: a float32 copy of the network that receives the averaged weights and is validated.
        views: names of the cameras whose pictures the network uses.
        validation: held-out samples.
        feed: supplies training batches.
        adversary: makes adversarial patches before every pass; None without adversarial training.
        root: folder of the results.
        plan: everything on which the weights depend, as JSON; a checkpoint is resumed only if its plan is equal.
        log: log of the training.
    """

    spec: TaskSpec[Any]
    task: Task[Any, Any]
    found: PluginEntry
    model: Any
    twin: Any
    views: Sequence[str]
    validation: Sequence[Any]
    feed: Feed
    adversary: Adversary | None
    root: Path
    plan: Json
    log: TrainLog


OnStep = Callable[[TrainingState, float, dict[str, float] | None], None]
"""A callback: gets the state, the finished share of the training (0..1), and the metrics after a validation or None."""

Pack = Callable[[dict[str, torch.Tensor], TrainingState], bytes]
"""A function that packs averaged weights and the state of the training into the bytes of a weights file."""


class Training:
    """One training, new or resumed from a checkpoint.

    Attributes:
        progress: the progress of the training.
    """

    def __init__(self, parts: Parts, config: TrainConfig, *, on_step: OnStep | None, pack: Pack) -> None:
        """Loads the checkpoint if the folder of the training has one; otherwise the training starts anew.

        Args:
            parts: network, data and folder of the training.
            config: config of the training.
            on_step: called after each step and validation; None for no calls.
            pack: function that returns the content of the weights file from the averaged weights and the progress.
        """
        self._parts, self._config, self._on_step, self._pack = parts, config, on_step, pack
        self._module: nn.Module = parts.model.module()
        self._memory = torch.channels_last if config.precision == "bfloat16" else torch.contiguous_format
        for parameter in self._module.parameters():
            if parameter.dim() == 4:
                parameter.data = parameter.data.contiguous(memory_format=self._memory)
        self._optimiser = optimiser_of(self._module, config)
        self._mean = RunningMean(self._module, config.ema)
        self._before = Buffers(self._module)
        self._device = device_of(config.device)
        found = checkpoint.load(parts.root, parts.plan, self._module, self._mean, self._optimiser)
        self.progress, extra = found or (TrainingState(), {})
        if parts.adversary is not None:
            parts.adversary.restore(extra)
        self._saved_s = self.progress.elapsed_s

    @property
    def share(self) -> float:
        """Share of the training that is finished, 0..1."""
        if self._config.time_budget_s:
            return min(1.0, self.progress.elapsed_s / self._config.time_budget_s)
        return min(1.0, self.progress.step / (self._config.epochs * self._parts.feed.batches))

    def run(self) -> TrainingState:
        """Trains to the end and returns the final progress.

        Raises:
            DatasetError: a training is resumed and the file of its best weights is missing; raised before the first
                step.
        """
        self._parts.log.begin(self.progress)
        _train_mode(self._parts.model, True)
        _train_mode(self._parts.twin, False)
        if self.progress.best_step == self.progress.step and not is_kept(self._parts.root, self.progress):
            self._keep_best()
        if self.progress.best_step >= 0:
            check_kept(self._parts.root, self.progress)
        while not self._is_over:
            self._make_patches()
            with contextlib.closing(self._parts.feed.from_position(self.progress.position)) as batches:
                self._passes(batches)
        if not self.progress.validations or self.progress.validations[-1]["step"] != self.progress.step:
            self._validate()
        _train_mode(self._parts.model, False)
        return self.progress

    def _passes(self, batches: Iterator[Batch]) -> None:
        """Runs steps until the training is over, or with an adversary until the end of the pass, because the next
        pass uses other patches.
        """
        while not self._is_over:
            with self._timed():
                self._step(next(batches))
            if self.progress.steps and self.progress.steps[-1]["step"] == self.progress.step:
                self._parts.log.noted(self.progress)
            if self._is_time_to_validate:
                self._validate()
            elif self.progress.elapsed_s - self._saved_s > CHECKPOINT_EVERY_S:
                self._save()
            if self._on_step is not None:
                self._on_step(self.progress, self.share, None)
            if self._parts.adversary is not None and self.progress.position.batch == 0:
                return

    def _make_patches(self) -> None:
        """Optimises patches against the averaged weights, if a pass begins and the training is adversarial."""
        adversary, position = self._parts.adversary, self.progress.position
        if adversary is None or position.batch:
            return
        with self._timed(), seeded(int(derive_rng(self._config.seed, "patches", position.epoch).integers(2**31))):
            self._parts.twin.module().load_state_dict(self._mean.state)
            adversary.refresh(self._parts.twin, position.epoch)
        self._parts.log.patches(self.progress, adversary)

    @property
    def _is_over(self) -> bool:
        has_enough = bool(self._config.patience) and self.progress.worse >= self._config.patience
        return self.share >= 1 or has_enough

    @property
    def _is_time_to_validate(self) -> bool:
        """True at the end of every pass; with a time budget instead, whenever validations have taken less than
        their share of the time.
        """
        progress = self.progress
        if not self._config.time_budget_s:
            return progress.position.batch == 0
        last = progress.validations[-1] if progress.validations else None
        since_s = progress.elapsed_s - (last["elapsed_s"] if last else 0.0)
        wanted_s = last["took_s"] / VALIDATION_SHARE if last else 0.0
        return since_s > max(wanted_s, self._config.time_budget_s / MOST_VALIDATIONS)

    def _step(self, batch: Batch) -> None:
        progress, config = self.progress, self._config
        factor = rate_share(self.share, warmup_fraction=config.warmup_fraction, final=config.final_lr_fraction)
        for group in self._optimiser.param_groups:
            group["lr"] = config.learning_rate * factor
        views = {name: picture.contiguous(memory_format=self._memory) for name, picture in batch.views.items()}
        self._before.keep()
        with seeded(int(derive_rng(config.seed, "step", progress.step).integers(2**31))):
            with autocast(self._device, config.precision):
                loss = self._loss(views, batch)
            self._optimiser.zero_grad(set_to_none=True)
            loss.backward()  # type: ignore[no-untyped-call]
        norm = clip_gradients(self._module, config.gradient_norm)
        is_finite = bool(torch.isfinite(norm) & torch.isfinite(loss.detach()))
        self._count_broken(is_finite, loss)
        if is_finite:
            self._optimiser.step()
            self._mean.update(self._module, progress.step)
            progress.open_losses.append(float(loss.detach()))
        else:
            self._before.put_back()
        progress.step += 1
        progress.position = progress.position.following(self._parts.feed.batches)
        if progress.step % NOTE_EVERY == 0 and progress.open_losses:
            point = {"step": progress.step, "loss": math.fsum(progress.open_losses) / len(progress.open_losses)}
            progress.steps.append(point | {"rate": config.learning_rate * factor})
            progress.open_losses.clear()

    def _loss(self, views: Mapping[str, torch.Tensor], batch: Batch) -> torch.Tensor:
        with blamed(self._parts.found, "forward"):
            try:
                loss = total(self._parts.model.forward(views, batch.samples))
            except ValueError as error:
                if len(batch.samples) == 1 and ONE_VALUE in str(error):
                    raise GearError(
                        "this network normalises over the samples of a batch, and there is one; train on two samples "
                        "or more, with --batch 2 or more"
                    ) from error
                raise
            if not loss.requires_grad:
                raise ValueError("its losses do not depend on anything that can be trained")
            return loss

    def _count_broken(self, is_finite: bool, loss: torch.Tensor) -> None:
        """Counts consecutive steps with a loss or gradients that are not finite; raises an error after too many of
        them.
        """
        progress = self.progress
        progress.broken = 0 if is_finite else progress.broken + 1
        if progress.broken > MOST_BROKEN_STEPS:
            raise GearError(
                f"the loss is {float(loss.detach()):g} or its gradients are, {progress.broken} steps in a row, at step "
                f"{progress.step}; lower --lr, or clip with --set gradient_norm=1"
            )

    def _validate(self) -> None:
        parts, progress = self._parts, self.progress
        with self._timed() as spent:
            parts.twin.module().load_state_dict(self._mean.state)
            metrics = validate(parts.twin, parts.found, parts.task, parts.validation, parts.views)
        best = max((rank(old, parts.spec) for old in progress.validations), default=(-math.inf, -math.inf))
        is_better = rank(metrics, parts.spec) > best or not progress.validations
        entry = {"step": progress.step, "elapsed_s": progress.elapsed_s, "took_s": spent[0], **metrics}
        progress.validations.append(entry)
        parts.log.validated(progress, metrics, parts.twin, parts.views, parts.validation)
        progress.worse = 0 if is_better else progress.worse + 1
        if is_better:
            progress.best_step = progress.step
            self._keep_best()
        else:
            self._save()
        if self._on_step is not None:
            chosen = {name: metrics[name] for name in (parts.spec.metric,) if name in metrics}
            self._on_step(progress, self.share, chosen | metrics)

    def _keep_best(self) -> None:
        """Writes the checkpoint and then the weights file.

        After an interruption, the weights file can be made from the checkpoint, but not the reverse.
        """
        mean = {key: value.detach().cpu().clone() for key, value in self._mean.state.items()}
        weights = self._pack(mean, self.progress)
        self.progress.best_sha256 = sha256(weights)
        self._save()
        write_weights(self._parts.root, weights)

    def _save(self) -> None:
        self._parts.log.flush()
        extra = self._parts.adversary.state() if self._parts.adversary is not None else {}
        checkpoint.save(
            self._parts.root, self._parts.plan, self.progress, self._module, self._mean, self._optimiser, extra
        )
        self._saved_s = self.progress.elapsed_s

    @contextlib.contextmanager
    def _timed(self) -> Iterator[list[float]]:
        """Adds the time spent in the block to the elapsed time; yields a list whose only item is that time after
        the block.
        """
        spent, begin = [0.0], time.perf_counter()
        yield spent
        spent[0] = time.perf_counter() - begin
        self.progress.elapsed_s += spent[0]


def _train_mode(model: Any, is_training: bool) -> None:
    module: nn.Module = model if isinstance(model, nn.Module) else model.module()
    module.train(is_training)
