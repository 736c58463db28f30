"""Measures how much a patch harms a model.

The model predicts on the clean pictures, on pictures with the patch composed (pasted into the clean picture by a
compositor), and on pictures with the patch rendered.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from gear.contracts.defenses import FitReport
from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Evaluator
from gear.dataset.plan import Plan
from gear.dataset.reading import Dataset
from gear.measuring.gap.request import GapRequest
from gear.measuring.guard import open_guard
from gear.measuring.guarded_model import GuardedModel
from gear.measuring.metric_checks import checked_metrics
from gear.measuring.plugin_selection import check_model, chosen_model
from gear.measuring.shown_size import size_note
from gear.plugins.build import find, name_of_task
from gear.values.progress import Callbacks

CLEAN, RENDERED = "clean", "rendered"

Metrics = Mapping[str, float]
"""Values of metrics by name."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleEffect:
    """The effect of patches on the metrics of one sample.

    Attributes:
        index: index of the sample.
        clean: metrics of the sample without a patch; empty if the task has no metrics of single samples.
        change: metric with the patch minus metric without, by metric, for each compositor and for `rendered`; NaN if
            either value is NaN.
    """

    index: int
    clean: Metrics
    change: Mapping[str, Metrics]


@dataclass(frozen=True, slots=True, eq=False)
class Effect:
    """The task's metrics on clean, composed and rendered pictures of the same samples.

    Attributes:
        guarded: the model, with its defense if there is one.
        plan: plan of the clean dataset.
        evaluators: one evaluator for `clean`, one for each compositor by its name, and one for `rendered`.
        metric: name of the task's main metric.
        samples: effects of the samples that were added with `update`.
    """

    guarded: GuardedModel
    plan: Plan
    evaluators: Mapping[str, Evaluator[Any, Any]]
    metric: str
    samples: list[SampleEffect] = field(default_factory=list)

    @staticmethod
    def of(request: GapRequest, dataset: Dataset[Any], callbacks: Callbacks) -> Effect:
        """Opens the model and the defense of a request, and warns about settings that may be unintended.

        Args:
            request: arguments, which `gear.gap` describes.
            dataset: the rendered dataset with patches.
            callbacks: progress and warnings.

        Raises:
            UnknownNameError: there is no such model or defense.
            GearError: the model is for another task, or the defense does not fit it.
            ConfigError: an option cannot be read.
        """
        assert request.model is not None
        chosen = chosen_model(request.model, request.model_settings)
        check_model(chosen, dataset)
        guard = open_guard(request.guard, [chosen], dataset.plan.task["name"], callbacks=callbacks)
        learnt = guard.calibration
        for line in (size_note(chosen, dataset), *learnt.doubts(), learnt.note(dataset)):
            if line is not None:
                callbacks.on_warning(line)
        spec = find("task", name_of_task(dataset.plan.task)).spec
        assert isinstance(spec, TaskSpec)
        names = (CLEAN, *request.compositors, RENDERED)
        return Effect(
            guarded=GuardedModel(chosen, guard, seed=request.seed),
            plan=dataset.plan,
            evaluators={name: dataset.task.evaluator() for name in names},
            metric=spec.metric.rpartition(".")[2],
        )

    def update(self, index: int, clean: Any, patched: Mapping[str, Any]) -> None:
        """Adds the predictions on one sample to the metrics.

        Args:
            index: index of the sample.
            clean: the sample without a patch.
            patched: the sample with the patch, by name of the compositor and for `rendered`.
        """
        alone: dict[str, Metrics] = {}
        for name, sample in {CLEAN: clean, **patched}.items():
            (answer,) = self.guarded.predict([sample.images], [index])
            alone[name] = checked_metrics(self.plan, self.evaluators[name].update(sample, answer.prediction), "update")
        before = alone.pop(CLEAN)
        change = {
            name: {metric: metrics.get(metric, math.nan) - value for metric, value in before.items()}
            for name, metrics in alone.items()
        }
        self.samples.append(SampleEffect(index=index, clean=before, change=change))

    def fit_report(self) -> FitReport | None:
        """The defense's summary of its calibration; None without a defense, without a summary, or when no sample was
        added yet.
        """
        return self.guarded.fit_report()

    def result(self) -> dict[str, Metrics]:
        """The metrics over all samples: for `clean`, each compositor and `rendered`, a mapping from name of the metric
        to value.
        """
        return {name: checked_metrics(self.plan, one.result(), "result") for name, one in self.evaluators.items()}
