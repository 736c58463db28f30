"""What patches do to a model, digitally and rendered: one evaluator for each way of showing them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Evaluator
from gear.dataset.plan import Plan
from gear.dataset.reading import Dataset
from gear.measuring.calibration import opened_calibration
from gear.measuring.guarded_model import Player
from gear.measuring.metric_checks import said_of
from gear.measuring.plugin_selection import check_defense, check_model, chosen_defense, chosen_model
from gear.measuring.shown_size import size_note
from gear.plugins.build import find, name_of_task
from gear.values.progress import Progress

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
        notes: what the user may not have meant: that the model sees the pictures at another size than it learnt from,
            or what there is to say of the data that the defense learns from.
        samples: of those taken in so far.
    """

    player: Player
    plan: Plan
    evaluators: Mapping[str, Evaluator[Any, Any]]
    metric: str
    notes: tuple[str, ...] = ()
    samples: list[SampleEffect] = field(default_factory=list)

    @staticmethod
    def of(
        model: str,
        model_settings: Iterable[str],
        dataset: Dataset[Any],
        compositors: tuple[str, ...],
        *,
        defense: str | None = None,
        defense_settings: Iterable[str] = (),
        calibration: tuple[str | Path | None, str | Path | None] = (None, None),
        seed: int = 0,
        on_fit_progress: Progress | None = None,
    ) -> Effect:
        """For a model plugin, behind a defense plugin if one is named, which learns from `calibration`; `seed` is of
        what the defense draws.

        Raises:
            UnknownNameError: there is no such model or defense.
            GearError: it is not made for the dataset's task, or the defense does not suit it.
            ConfigError: its options cannot be read.
        """
        chosen = chosen_model(model, model_settings)
        check_model(chosen, dataset)
        task = dataset.plan.task["name"]
        guard = chosen_defense(defense, defense_settings)
        learnt = opened_calibration(*calibration, [chosen], defense, on_fit_progress=on_fit_progress)
        if guard is not None:
            check_defense(guard, chosen, task, is_calibrated=learnt.clean is not None)
        spec = find("task", name_of_task(dataset.plan.task)).spec
        assert isinstance(spec, TaskSpec)
        names = (CLEAN, *compositors, RENDERED)
        return Effect(
            player=Player(chosen, guard, calibration=learnt, seed=seed),
            plan=dataset.plan,
            evaluators={name: dataset.task.evaluator() for name in names},
            metric=spec.metric.rpartition(".")[2],
            notes=tuple(
                line
                for line in (size_note(chosen, dataset), *learnt.doubts(), learnt.note(dataset))
                if line is not None
            ),
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
