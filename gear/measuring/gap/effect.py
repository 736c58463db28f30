"""What patches do to a model, digitally and rendered: one evaluator for each way of showing them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Evaluator
from gear.dataset.plan import Plan
from gear.dataset.reading import Dataset
from gear.measuring.gap.request import GapRequest
from gear.measuring.guard import open_guard
from gear.measuring.guarded_model import Player
from gear.measuring.metric_checks import said_of
from gear.measuring.plugin_selection import check_model, chosen_model
from gear.measuring.shown_size import size_note
from gear.plugins.build import find, name_of_task
from gear.values.progress import Callbacks

CLEAN, RENDERED = "clean", "rendered"

Metrics = Mapping[str, float]
"""A task's metric by name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleEffect:
    """What patches change of one sample's own metrics.

    Attributes:
        index: which sample.
        clean: its metrics without a patch; those that a single sample has.
        change: what is added to them, by compositor's name and `rendered`; NaN where either metric is.
    """

    index: int
    clean: Metrics
    change: Mapping[str, Metrics]


@dataclass(frozen=True, slots=True, eq=False)
class Effect:
    """The task's metric on clean, composed and rendered pictures of the same samples.

    Attributes:
        player: the model, behind its defense if there is one.
        plan: of the dataset.
        evaluators: by `clean`, a compositor's name, or `rendered`.
        metric: of the task, the one that is to be looked at first.
        samples: of those taken in so far.
    """

    player: Player
    plan: Plan
    evaluators: Mapping[str, Evaluator[Any, Any]]
    metric: str
    samples: list[SampleEffect] = field(default_factory=list)

    @staticmethod
    def of(request: GapRequest, dataset: Dataset[Any], callbacks: Callbacks) -> Effect:
        """For the model of a request, behind its defense if there is one; warns of what the user may not have meant.

        Raises:
            UnknownNameError: there is no such model or defense.
            GearError: it is not made for the dataset's task, or the defense does not suit it.
            ConfigError: its options cannot be read.
        """
        assert request.model is not None
        chosen = chosen_model(request.model, request.model_settings)
        check_model(chosen, dataset)
        guard = open_guard(
            request.guard, [chosen], dataset.plan.task["name"], on_fit_progress=callbacks.on_fit_progress
        )
        learnt = guard.calibration
        for line in (size_note(chosen, dataset), *learnt.doubts(), learnt.note(dataset)):
            if line is not None:
                callbacks.on_warning(line)
        spec = find("task", name_of_task(dataset.plan.task)).spec
        assert isinstance(spec, TaskSpec)
        names = (CLEAN, *request.compositors, RENDERED)
        return Effect(
            player=Player(chosen, guard, seed=request.seed),
            plan=dataset.plan,
            evaluators={name: dataset.task.evaluator() for name in names},
            metric=spec.metric.rpartition(".")[2],
        )

    def update(self, index: int, clean: Any, shown: Mapping[str, Any]) -> None:
        """Takes in one sample: untouched, and with patches, by compositor and rendered."""
        alone: dict[str, Metrics] = {}
        for name, sample in {CLEAN: clean, **shown}.items():
            (answer,) = self.player.play([sample.images], [index])
            alone[name] = said_of(self.plan, self.evaluators[name].update(sample, answer.prediction), "update")
        before = alone.pop(CLEAN)
        change = {
            name: {metric: metrics.get(metric, math.nan) - value for metric, value in before.items()}
            for name, metrics in alone.items()
        }
        self.samples.append(SampleEffect(index=index, clean=before, change=change))

    def result(self) -> dict[str, Metrics]:
        """The metric of each."""
        return {name: said_of(self.plan, one.result(), "result") for name, one in self.evaluators.items()}
