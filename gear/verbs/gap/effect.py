"""What patches do to a model, digitally and rendered: one evaluator for each way of showing them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from gear.config.overrides import with_overrides
from gear.contracts.models import Model
from gear.contracts.specs import ModelSpec
from gear.contracts.tasks import Evaluator
from gear.dataset.reading import Dataset
from gear.plugins.build import NO_OPTIONS, blamed, build, find
from gear.plugins.catalogue import Found
from gear.values.errors import GearError

CLEAN, RENDERED = "clean", "rendered"

Figures = Mapping[str, float]
"""A task's metric by name."""


@dataclass(frozen=True, slots=True, eq=False)
class Effect:
    """The task's metric on clean, composed and rendered pictures of the same samples.

    Attributes:
        found: the model's plugin.
        model: what it built.
        evaluators: by `clean`, a compositor's name, or `rendered`.
    """

    found: Found
    model: Model
    evaluators: Mapping[str, Evaluator[Any, Any]] = field(default_factory=dict)

    @staticmethod
    def of(model: str, settings: Iterable[str], dataset: Dataset[Any], compositors: tuple[str, ...]) -> Effect:
        """For a model plugin.

        Raises:
            UnknownNameError: there is no such model.
            GearError: it is not made for the dataset's task.
            ConfigError: its options cannot be read.
        """
        found = find("model", model)
        spec = found.spec
        assert isinstance(spec, ModelSpec)
        task = dataset.plan.task["name"]
        if task not in spec.tasks:
            raise GearError(f"model {spec.name!r} is for {', '.join(spec.tasks)}; this is a {task} dataset")
        product = build(found, with_overrides(NO_OPTIONS, settings))
        names = (CLEAN, *compositors, RENDERED)
        return Effect(found, product, {name: dataset.task.evaluator() for name in names})

    def update(self, clean: Any, shown: Mapping[str, Any]) -> None:
        """Takes in one sample: untouched, and with patches, by compositor and rendered."""
        with blamed(self.found, "predict"):
            for name, sample in {CLEAN: clean, **shown}.items():
                self.evaluators[name].update(sample, self.model.predict(sample.images))

    def result(self) -> dict[str, Figures]:
        """The metric of each."""
        return {name: dict(evaluator.result()) for name, evaluator in self.evaluators.items()}
