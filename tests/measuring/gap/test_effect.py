"""The effect of patches on a model."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

from gear.measuring.gap.effect import Effect


class Evaluator:
    """The mean of predictions."""

    def __init__(self) -> None:
        self.values: list[float] = []

    def update(self, sample: Any, prediction: float) -> dict[str, float]:
        self.values.append(prediction)
        return {"score": prediction} if prediction < 5 else {}

    def result(self) -> dict[str, float]:
        return {"score": sum(self.values) / len(self.values)}


def test_changes_are_relative_to_the_clean_picture() -> None:
    guarded: Any = SimpleNamespace(predict=lambda pictures, indices: [SimpleNamespace(prediction=pictures[0])])
    plan: Any = SimpleNamespace(task={"package": "mujoco-gear", "name": "semseg"})
    evaluators: Any = {name: Evaluator() for name in ("clean", "transport", "rendered")}
    effect = Effect(guarded=guarded, plan=plan, evaluators=evaluators, metric="score")
    for index, (clean, composed, rendered) in enumerate([(4.0, 3.0, 2.5), (2.0, 1.0, 9.0)]):
        shown = {"transport": SimpleNamespace(images=composed), "rendered": SimpleNamespace(images=rendered)}
        effect.update(index, SimpleNamespace(images=clean), shown)
    first, second = effect.samples
    assert (first.index, first.clean) == (0, {"score": 4.0})
    assert first.change == {"transport": {"score": -1.0}, "rendered": {"score": -1.5}}
    assert math.isnan(second.change["rendered"]["score"])
    assert effect.result() == {"clean": {"score": 3.0}, "transport": {"score": 2.0}, "rendered": {"score": 5.75}}
