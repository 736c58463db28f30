"""Results of defenses are checked against the contract."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from gear.contracts.defenses import DefenseResult, FitReport
from gear.measuring.checked_defense import CheckedDefense
from gear.plugins.build import find
from gear.values.errors import PluginError

PICTURE = np.zeros((4, 6, 3), np.uint8)


class Returning:
    """A defense that returns a given result."""

    def __init__(self, result: Any) -> None:
        self.result = result

    def apply(self, views: Mapping[str, Any], model: Any, state: Any, rng: np.random.Generator) -> Any:
        return self.result


class State:
    def fit_report(self) -> FitReport:
        return FitReport(values={"loss": 0.5})


def applied(result: Any, name: str = "jpeg") -> DefenseResult:
    defense: Any = Returning(result)
    return CheckedDefense(find("defense", name), defense).apply({"left": PICTURE.copy()}, np.random.default_rng(0), 7)


def test_a_sound_result_passes_and_numpy_scores_become_floats() -> None:
    mask = {"left": np.ones((4, 6), np.float32)}
    found = applied(DefenseResult(views={"left": PICTURE}, mask=mask, score=np.float32(0.25)))  # type: ignore[arg-type]
    assert type(found.score) is float
    assert found.score == 0.25


@pytest.mark.parametrize(
    ("result", "message"),
    [
        (None, "apply returns a DefenseResult, got NoneType"),
        (DefenseResult(views={}), r"views\['left'\] must have shape \(4, 6, 3\) of uint8"),
        (DefenseResult(views={"left": PICTURE / 255}), "of uint8"),
        (DefenseResult(views={"left": PICTURE}, mask={"left": np.ones((4, 6))}), r"mask\['left'\] must have shape"),
        (DefenseResult(views={"left": PICTURE}, mask={"left": np.full((4, 6), 2, np.float32)}), "must lie in 0..1"),
        (DefenseResult(views={"left": PICTURE}, mask={"left": np.full((4, 6), np.nan, np.float32)}), "lie in 0..1"),
        (DefenseResult(views={"left": PICTURE}, score=1.5), "score must be a float in 0..1, got 1.5"),
    ],
)
def test_a_broken_result_names_the_defense_and_the_sample(result: Any, message: str) -> None:
    with pytest.raises(PluginError, match=message) as caught:
        applied(result)
    assert "jpeg" in str(caught.value)
    assert "apply on sample 7" in str(caught.value)


def test_a_declared_score_must_be_there() -> None:
    with pytest.raises(PluginError, match="score must be a float"):
        applied(DefenseResult(views={"left": PICTURE}), "hyperneuron")


def test_it_is_calibrated_once_and_late() -> None:
    calls: list[int] = []

    def learn() -> State:
        calls.append(1)
        return State()

    defense: Any = Returning(DefenseResult(views={"left": PICTURE}))
    checked = CheckedDefense(find("defense", "jpeg"), defense, learn=learn)
    assert checked.fit_report() is None
    assert calls == []
    for index in range(2):
        checked.apply({"left": PICTURE.copy()}, np.random.default_rng(0), index)
    assert calls == [1]
    report = checked.fit_report()
    assert report is not None
    assert report.values == {"loss": 0.5}
