"""The result of an attack as text."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import numpy as np

from gear.contracts.attacks import Patch
from gear.verbs.attack.report import AttackReport

FACTS: dict[str, Any] = {
    "steps_done": 30,
    "steps_per_s": 2.0,
    "stopped": "",
    "gradient_check": None,
    "task": "depth",
    "data": [{"scene": "town10/billboard01"}],
    "achieved": {"training": {"samples": 8, "random": 0.25, "patch": 1.5}, "validation": None},
}


def report(*, made: bool = True, **facts: Any) -> AttackReport:
    patch = Patch(name="patch_0", rgb=np.zeros((2, 2, 3), np.float32))
    return AttackReport(out=Path("my patches"), patches=(patch,), facts={**FACTS, **facts}, made=made)


def test_the_summary_has_steps_objectives_and_the_next_command() -> None:
    lines = report().summary().split("\n")
    assert lines[0] == "my patches: 1 patch after 30 steps, 2 per second"
    assert lines[1] == "objective on 8 training samples: 0.25 with random patches, 1.5 with these"
    assert lines[2] == f"next: {report().next_command}"
    assert len(lines) == 3


def test_what_is_unusual_is_added() -> None:
    text = report(
        made=False, stopped="no improvement", gradient_check={"measured_change": 0.1, "predicted_change": 1.0}
    ).summary()
    assert "(there already)" in text
    assert "ended early: no improvement" in text
    assert "gradients are masked" in text
    assert "masked" not in report(gradient_check={"measured_change": 0.9, "predicted_change": 1.0}).summary()


def test_the_next_command_asks_for_a_town_that_gear_does_not_have() -> None:
    words = shlex.split(report().next_command)
    assert words[-4:] == ["--town", "town10", "--patch", "my patches"]
    other = shlex.split(report(data=[{"scene": "mine/corner"}]).next_command)
    assert other[-4:-2] == ["--town", "TOWN.xml"]
    assert other[other.index("--scene") + 1] == "SCENES.yml:corner"
    last = report(data=[{"scene": "mine/corner"}]).summary().split("\n")[-1]
    assert last.endswith("(TOWN.xml and SCENES.yml: the files of the town)")
