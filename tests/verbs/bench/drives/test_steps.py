"""Drives as steps of a bench: what is planned, what they wait for, and the whole way on the tiny town."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import pytest

import gear
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.driving.config import DriveConfig
from gear.plugins.build import NO_OPTIONS
from gear.values.errors import GearError
from gear.verbs.bench.command import command
from gear.verbs.bench.drives.steps import every_step, planned_drives, settings
from gear.verbs.bench.plan import Plan
from gear.verbs.bench.request import BenchRequest
from gear.verbs.bench.run import prepared
from gear.verbs.bench.schedule import dependencies
from tests.verbs.bench.conftest import FEW

pytestmark = pytest.mark.usefixtures("plugins")

LIBRARY = """
scenarios:
  near: {ttc_s: 1.0, duration_s: 1.5, lead: {speed_share: 0}}
  free: {duration_s: 1.0}
"""


def drives(folder: Path, text: str = "") -> tuple[str, str]:
    """A change of the bench config that adds drives."""
    (folder / "library.yml").write_text(LIBRARY)
    section = f"drives:\n  library: {folder / 'library.yml'}\n  scenarios: {{near: [20], free: [20]}}\n{text}"
    return ("collect:\n  renderer", f"{section}collect:\n  renderer")


def plan_of(config: Path) -> Plan:
    return prepared(BenchRequest(config=config, out=config.parent / "out"))


def test_a_bench_without_drives_has_none(written: Callable[..., Path]) -> None:
    plan = plan_of(written(*FEW))
    assert list(planned_drives(plan)) == [] and [step.verb for step in every_step(plan)].count("drive") == 0


def test_every_network_drives_alone_and_behind_each_defense(written: Callable[..., Path], tmp_path: Path) -> None:
    plan = plan_of(written(drives(tmp_path, "  references: [truth]\n")))
    found = list(planned_drives(plan))
    assert [(one.scene.label, one.is_adaptive) for one in found] == [
        ("tiny-board", False), ("tiny-board", True), ("tiny-double", False), ("tiny-double", True),
    ]  # fmt: skip
    assert list(found[0].drivers) == [
        "small", "small-behind-blur", "small-behind-fpda", "second", "second-behind-blur", "second-behind-fpda",
        "truth",
    ]  # fmt: skip
    guarded = [name for name in found[0].drivers if "behind" in name]
    assert list(found[1].drivers) == guarded, "defenses with adaptive patches"
    config = read_node(DriveConfig, with_overrides(NO_OPTIONS, settings(found[0].config)))
    assert config.drivers["second"].patch == str(tmp_path / "out/patches/semseg/second/tiny-board")
    assert config.drivers["small-behind-fpda"].calibration.endswith("calibrate-none")
    adaptive = read_node(DriveConfig, with_overrides(NO_OPTIONS, settings(found[1].config)))
    assert adaptive.twins == ("patch",)
    assert adaptive.drivers["small-behind-blur"].patch.endswith("semseg/small+blur/tiny-board")


def test_every_network_drives_in_every_weather(written: Callable[..., Path], tmp_path: Path) -> None:
    two = ("samples: {", "weathers: [ClearNoon, {preset: ClearNoon, wetness: 80}]\nsamples: {")
    found = list(planned_drives(plan_of(written(*FEW, two, drives(tmp_path)))))
    assert [one.weather for one in found] == ["ClearNoon", "ClearNoon-changed"]
    assert [one.out.name for one in found] == ["ClearNoon", "ClearNoon-changed"] and found[0].out != found[1].out
    configs = [read_node(DriveConfig, with_overrides(NO_OPTIONS, settings(one.config))) for one in found]
    assert [one.weather.wetness for one in configs] == [None, 80.0]


def test_drives_wait_for_their_patches_and_calibration(written: Callable[..., Path], tmp_path: Path) -> None:
    steps = every_step(plan_of(written(drives(tmp_path))))
    needed = dependencies(steps)
    driving = next(number for number, step in enumerate(steps) if step.verb == "drive")
    before = {steps[number].verb for number in needed[driving]}
    outs = [Path(steps[number].arguments["out"]) for number in needed[driving]]
    assert before == {"attack", "collect"} and tmp_path / "out/patches/semseg/small/tiny-board" in outs
    assert any(out.name == "calibrate-patch-small" for out in outs)
    assert command(steps[driving]).startswith("gear drive quick --out ")


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("  controllers: {semseg: nobody}\n", "nobody"),
        ("  controllers: {semseg: depth_baseline}\n", "reads depth, not semseg"),
        ("  references: [turth]\n", "did you mean truth"),
        ("  repeats: 0\n", "repeats"),
        ("  scenarios: {nea: [20]}\n", "scenarios"),
        ("  crowd: 1e9\n", "crowd"),
    ],
)
def test_impossible_drives_are_one_line(written: Callable[..., Path], tmp_path: Path, text: str, problem: str) -> None:
    change = drives(tmp_path, text)
    if text.startswith("  scenarios"):
        change = (change[0], change[1].replace("  scenarios: {near: [20], free: [20]}\n", ""))
    with pytest.raises(GearError, match=problem) as caught:
        plan_of(written(*FEW, change))
    assert "\n" not in str(caught.value) and "bench.yml:" in str(caught.value)


@pytest.mark.slow
def test_the_whole_way_with_drives(made: Callable[..., Path], written: Callable[..., Path], tmp_path: Path) -> None:
    """The pictures, patches and evaluations are there already; the drives are made, reported and kept."""
    out, config = made(FEW), written(*FEW, drives(tmp_path, "  references: [truth]\n"))
    report = gear.bench(config, out=out)
    assert report.drives is not None and report.drives.failed == ()
    lines = {(line.driver.model, line.driver.defense, line.scenario, line.patch): line for line in report.drives.lines}
    alone = [lines["small", None, "all", kind] for kind in ("none", "random", "patch")]
    assert [line.crashes.total for line in alone] == [1, 1, 1] and alone[2].paired[0].pairs == 1
    assert ("small", "blur", "near", "patch") in lines and (None, None, "all", "none") in lines
    assert ("small", None, "free", "none") in lines and ("small", None, "free", "all") not in lines
    rows = list(csv.DictReader((out / "drives.csv").read_text().splitlines()))
    assert len(rows) == len(lines) and rows[0]["collision_rate"] in ("0.0", "1.0")
    written_json = json.loads((out / "bench.json").read_text())["drives"]
    assert written_json["studies"] == ["drives/semseg/tiny-board"] and len(written_json["lines"]) == len(rows)
    page, latex = (out / "report.html").read_text(), (out / "tables/drives.tex").read_text()
    assert 'href="drives/semseg/tiny-board/report.html"' in page and "Collision rates of the drives" in page
    assert "small" in latex and r"\input{drives}" in (out / "tables/tables.tex").read_text()
    assert "collision rate" in (out / "table.txt").read_text()
    logs = {path: path.stat().st_mtime_ns for path in out.glob("drives/**/log.jsonl")}
    texts = [(out / name).read_bytes() for name in ("bench.json", "report.html", "drives.csv")]
    assert len(logs) == 2 * (3 + 3 + 1)
    gear.bench(config, out=out)
    assert {path: path.stat().st_mtime_ns for path in logs} == logs, "finished drives are kept"
    assert [(out / name).read_bytes() for name in ("bench.json", "report.html", "drives.csv")] == texts
