"""Validation: computes the task's metrics and the network's losses on held-out samples."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import torch

from gear.contracts.evaluation import Reports
from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Task
from gear.dataset.checks.output_checks import check_metrics
from gear.plugins.build import blamed
from gear.plugins.catalogue import PluginEntry
from gear.readers import TorchDataset, as_pictures
from gear.values.errors import GearError

LOSS = "loss"


def validate(
    model: Any, plugin: PluginEntry, task: Task[Any, Any], samples: Sequence[Any], views: Sequence[str]
) -> dict[str, float]:
    """Computes the validation metrics of a network over samples.

    Args:
        model: the network, in eval mode.
        plugin: plugin of the network.
        task: the task, which supplies the evaluators.
        samples: held-out samples.
        views: names of the cameras whose pictures the network uses.

    Returns:
        The metrics of the task's evaluator by name, the metrics of its further reports as `<report>.<metric>`, and
        `loss`, the mean over samples of the sum of all losses.

    Raises:
        GearError: a prediction cannot be scored, or a metric of the task is not a number.
        PluginError: a network of another package failed, or returned neither losses nor predictions of the task.
    """
    evaluators = {"": task.evaluator()}
    if isinstance(task, Reports):
        evaluators |= {f"{name}.": evaluator for name, evaluator in task.reports().items()}
    losses = []
    items = TorchDataset(samples, views=views)
    for item in (items[index] for index in range(len(items))):
        sample = item.sample
        pictures = {name: sample.images[name] for name in views}
        batch = as_pictures({name: picture[None] for name, picture in item.views.items()})
        with blamed(plugin, "forward"), torch.no_grad():
            losses.append(float(total(model.forward(batch, [sample]))))
        with blamed(plugin, "predict"):
            prediction = model.predict(pictures)
        with blamed(plugin, "prediction"):
            for evaluator in evaluators.values():
                try:
                    evaluator.update(sample, prediction)
                except ValueError as error:
                    raise GearError(
                        f"cannot score the prediction for a validation picture ({error}); if the training "
                        "diverged, train again with a lower --lr in another --out"
                    ) from error
    metrics = {
        f"{prefix}{name}": value
        for prefix, evaluator in evaluators.items()
        for name, value in _said(evaluator.result()).items()
    }
    return {**metrics, LOSS: math.fsum(losses) / len(losses)}


def _said(given: Any) -> dict[str, float]:
    try:
        return check_metrics(given, "result of the task's evaluator")
    except TypeError as error:
        raise GearError(str(error)) from error


def total(losses: Mapping[str, torch.Tensor]) -> torch.Tensor:
    """Returns the sum of named losses, which the training minimises.

    Raises:
        TypeError: `losses` is not a mapping, or is empty.
    """
    if not isinstance(losses, Mapping) or not losses:
        given = "none" if isinstance(losses, Mapping) else type(losses).__name__
        raise TypeError(f"must give losses by name where it is given targets, got {given}")
    return torch.stack([loss.float() for loss in losses.values()]).sum()


def rank(metrics: Mapping[str, float], spec: TaskSpec[Any]) -> tuple[float, float]:
    """Returns a sort key for validations, larger for better ones: first the task's metric, then the loss.

    Args:
        metrics: metrics of one validation, by name, with the loss.
        spec: spec of the task, which names the metric and says whether lower is better.
    """
    loss = -metrics[LOSS] if metrics[LOSS] == metrics[LOSS] else -math.inf
    value = metrics.get(spec.metric, math.nan)
    if value != value:
        return (-math.inf, loss)
    return (-value if spec.lower_is_better else value, loss)
