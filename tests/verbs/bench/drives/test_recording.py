"""Claims about drives from the results of a bench."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from gear.verbs.bench.drives.recording import drive_claims, label_of
from gear.verbs.bench.drives.results import drive_section

from .test_results import drive, planned, section, study


def evaluation(model: str, defense: str | None, task: str = "depth") -> Any:
    name = None if defense is None else SimpleNamespace(label=defense)
    return SimpleNamespace(
        task_plugins=SimpleNamespace(name=task), model=SimpleNamespace(label=model), defense=name
    )  # fmt: skip


def test_the_driver_of_a_recorded_network_is_found() -> None:
    assert label_of(planned("a"), evaluation("net<", None)) == "net"
    assert label_of(planned("a"), evaluation("net<", "d")) == "net-d"
    assert label_of(planned("a"), evaluation("net<", "other")) is None
    assert label_of(planned("a"), evaluation("net<", None, task="semseg")) is None


def test_each_drive_is_a_claim_with_its_kind_of_patch() -> None:
    alone, guarded = (drive_claims(section(), evaluation("net<", defense)) for defense in (None, "d"))
    assert len(alone) == 2 * (3 * 5 + 1) and sum(one.is_free for one in alone) == 2
    assert {one.patch for one in alone} == {"none", "random", "patch"}
    assert sum(one.is_crash for one in alone if one.patch == "patch") == 10
    assert sum(one.is_crash for one in guarded) == 10
    assert {one.patch for one in guarded if one.is_crash} == {"adaptive patch"}
    assert drive_claims(None, evaluation("net<", None)) == ()


def test_claims_of_several_weathers_differ() -> None:
    made = [(planned("a", weather=one), study([drive("net", "none", 0, "a")])) for one in ("Clear", "Wet")]
    claims = drive_claims(drive_section(made, Path("out")), evaluation("net<", None))
    assert [one.weather for one in claims] == ["Clear", "Wet"] and len({one.key for one in claims}) == 2
    assert {one.scene for one in claims} == {"a"}
