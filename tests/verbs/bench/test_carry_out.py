"""Single steps of a bench: the names of failed steps, and results that are replaced."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from gear.values.errors import GearError, OutdatedError
from gear.values.progress import Callbacks
from gear.verbs.bench.carry_out import VERBS, carry_out
from gear.verbs.bench.plan import Step, Verb

STEP = Step(verb="collect", title="collect depth", arguments={"out": "data", "workers": 4})


def test_arguments_can_be_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    called: list[Any] = []
    monkeypatch.setitem(VERBS, "collect", lambda **arguments: called.append(arguments))
    carry_out(STEP, Path(), Callbacks(), changed={"workers": 1})
    assert called[0]["workers"] == 1 and called[0]["out"] == "data" and STEP.arguments["workers"] == 4
    assert "on_fit_progress" not in called[0]


@pytest.mark.parametrize("verb", ["attack", "evaluate", "drive"])
def test_calibrations_of_a_step_are_shown(verb: Verb, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[str, int, int]] = []
    monkeypatch.setitem(VERBS, verb, lambda **arguments: arguments["on_fit_phase"]("training step", 1, 2))
    callbacks = Callbacks.of(on_fit_phase=lambda *phase: seen.append(phase))
    carry_out(Step(verb=verb, title="a step", arguments={}), Path(), callbacks)
    assert seen == [("training step", 1, 2)]


def test_an_outdated_result_is_replaced_with_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    def outdated(*, force: bool = False, **arguments: Any) -> str:
        if not force:
            raise OutdatedError("data", "was made of other pictures")
        return "new"

    notes: list[str] = []
    monkeypatch.setitem(VERBS, "collect", outdated)
    assert carry_out(STEP, Path(), Callbacks.of(on_warning=notes.append)) == "new"
    assert notes == ["collect depth: is made again, for what is there was made of other pictures"]


def test_an_error_names_its_step(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(**arguments: Any) -> None:
        raise GearError("no renderer here")

    monkeypatch.setitem(VERBS, "collect", failing)
    with pytest.raises(GearError, match=r"^collect depth: no renderer here$"):
        carry_out(STEP, Path(), Callbacks())
