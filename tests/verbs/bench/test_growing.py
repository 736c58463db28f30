"""A bench whose config asks for more pictures goes on: what was made from fewer is made again, the rest is kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import gear
from gear.values.errors import GearError
from gear.verbs.bench.carry_out import VERBS
from gear.verbs.bench.plan import Step
from tests.verbs.bench.conftest import FEW, LEARNING, callbacks

pytestmark = pytest.mark.usefixtures("plugins")

Written = Callable[..., Path]
Made = Callable[..., Path]


class Looks:
    """Remembers what it is told."""

    def __init__(self) -> None:
        self.notes: list[str] = []

    def on_step(self, step: Step, number: int, steps: int) -> None: ...

    def on_progress(self, done: int, total: int) -> None: ...

    def on_fit_progress(self, done: int, total: int) -> None: ...

    def on_warning(self, line: str) -> None:
        self.notes.append(line)


def times(root: Path, kind: str) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in root.glob(f"data/semseg/*/ClearNoon/{kind}/**/*.png")}


def test_more_pictures_to_attack(tmp_path: Path, written: Written, made: Made) -> None:
    out, looks = made(LEARNING), Looks()
    kept = {kind: times(out, kind) for kind in ("attack", "none", "random")}
    patch = (out / "patches/semseg/small/tiny-board/patch_0.png").read_bytes()
    more = (*LEARNING, ("attack: 2", "attack: 3"))
    report = gear.bench(written(*more), out=out, **callbacks(looks))
    for kind, before in kept.items():
        assert before and before.items() <= times(out, kind).items(), "what is there is not collected again"
    assert len(times(out, "attack")) > len(kept["attack"])
    assert (out / "patches/semseg/small/tiny-board/patch_0.png").read_bytes() != patch
    fresh = gear.bench(written(*more), out=tmp_path / "fresh")
    metrics, wanted = (
        [[row.metrics for row in one.evaluation.rows] for one in bench.tasks[0].results] for bench in (report, fresh)
    )
    assert str(metrics) == str(wanted), "the tables are those of a bench that was begun with so many"
    assert [line.split()[0] for line in looks.notes] == [*["attack", "collect"] * 3, "evaluate"]
    assert all("is made again, for what is there" in line for line in looks.notes)
    again = Looks()
    assert gear.bench(written(*more), out=out, **callbacks(again)).tasks[0].results[0].evaluation.rows[0].made == 0
    assert not again.notes


class Leaves(Looks):
    """Goes away after so many steps of the first attack; 0 for as soon as it is done."""

    def __init__(self, after: int) -> None:
        super().__init__()
        self.after, self.attacks = after, False

    def on_step(self, step: Step, number: int, steps: int) -> None:
        if self.attacks:
            raise KeyboardInterrupt
        self.attacks = step.verb == "attack"

    def on_progress(self, done: int, total: int) -> None:
        if self.attacks and done == self.after > 0:
            raise KeyboardInterrupt


def test_more_pictures_to_an_attack_that_was_stopped(
    tmp_path: Path, written: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gear.verbs.attack.monitor.SECONDS_BETWEEN", 0.0)
    out, looks = tmp_path / "out", Leaves(0)
    with pytest.raises(KeyboardInterrupt):
        gear.bench(written(*FEW), out=out, **callbacks(Leaves(1)))
    patch = out / "patches/semseg/small/tiny-board"
    assert (patch / "checkpoint.safetensors").exists()
    with pytest.raises(KeyboardInterrupt):
        gear.bench(written(*FEW, ("attack: 2", "attack: 3")), out=out, **callbacks(looks))
    (line,) = looks.notes
    assert line.startswith("attack small of semseg") and "is made again, for what is there holds an unfinished" in line
    assert (patch / "attack.json").exists() and not (patch / "checkpoint.safetensors").exists()


def test_a_bench_that_is_refused_leaves_the_config_of_its_reports(
    written: Written, made: Made, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, more = made(LEARNING), (*LEARNING, ("attack: 2", "attack: 3"))
    before = (out / "bench.yml").read_bytes()

    def refused(*given: Any, **more: Any) -> Any:
        raise GearError("no")

    with monkeypatch.context() as patched:
        patched.setitem(VERBS, "collect", refused)
        with pytest.raises(GearError, match=r"no$"):
            gear.bench(written(*more), out=out)
    assert (out / "bench.yml").read_bytes() == before
    gear.bench(written(*more), out=out)
    assert b"attack: 3" in (out / "bench.yml").read_bytes() and b"attack: 2" in before


def test_more_pictures_to_learn_from(written: Written, made: Made) -> None:
    out, looks = made(LEARNING), Looks()
    report = gear.bench(written(*LEARNING, ("calibrate: 8", "calibrate: 9")), out=out, **callbacks(looks))
    alone, guarded = report.tasks[0].results
    assert [row.made for row in alone.evaluation.rows] == [0, 0, 0]
    assert [row.made for row in guarded.evaluation.rows] == [2, 2, 2, 2]
    assert [line.split()[0] for line in looks.notes] == ["attack", "collect", "evaluate"]
    assert all("small+fpda" in line and "is made again" in line for line in looks.notes)
    assert all("calibration_samples" in looks.notes[number] for number in (0, 2))


def test_patches_that_are_wanted_otherwise_are_not_made_again(written: Written, made: Made) -> None:
    out = made(FEW)
    with pytest.raises(GearError, match=r"other settings \(steps: 2 there, 3 now\); use another --out, or remove it$"):
        gear.bench(written(*FEW, ("steps: 2", "steps: 3")), out=out)
