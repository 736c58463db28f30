"""Collision rates of a bench from results that are written by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gear.driving.statistics import Paired
from gear.driving.worker import DriveResult
from gear.verbs.bench.drives.results import COLUMNS, DriveSection, drive_section
from gear.verbs.bench.drives.steps import BenchDriver, PlannedDrives
from gear.verbs.bench.paper.page import paper_table
from gear.verbs.bench.paper.tables import paper_tables
from gear.verbs.drive.report import DriveReport
from tests.verbs.bench.synthetic import report as bench_report
from tests.verbs.drive.test_report import result

NET, GUARDED = (
    BenchDriver(model="net<", defense=None, controller="base"),
    BenchDriver(model="net<", defense="d", controller="base"),
)
TRUTH = BenchDriver(model=None, defense=None, controller="truth")


def planned(scene: str, *, weather: str = "", is_adaptive: bool = False) -> PlannedDrives:
    plugins: Any = SimpleNamespace(name="depth")
    place: Any = SimpleNamespace(label=scene)
    return PlannedDrives(
        task_plugins=plugins, scene=place, weather=weather, is_adaptive=is_adaptive,
        out=Path("out/drives/depth") / scene, drivers={"net": NET, "net-d": GUARDED, "truth": TRUTH}, config={},
        inputs=(),
    )  # fmt: skip


def drive(driver: str, twin: str, seed: int, scene: str, *, is_crash: bool = False) -> DriveResult:
    one = result(twin, seed, is_crash=is_crash)
    return replace(one, run=replace(one.run, driver=driver, scene=scene))


def study(results: list[DriveResult], failed: tuple[tuple[str, str], ...] = ()) -> DriveReport:
    return DriveReport(out=Path("x"), results=tuple(results), failed=failed, facts={}, free=frozenset({"free_road"}))


def section() -> DriveSection:
    """Two scenes of five seeds: the patch crashes the network always, behind the defense only the adaptive one."""
    made = []
    for scene in ("a", "b"):
        results = [drive("truth", "none", seed, scene) for seed in range(5)]
        for twin in ("none", "random", "patch"):
            results += [drive("net", twin, seed, scene, is_crash=twin == "patch") for seed in range(5)]
            results += [drive("net-d", twin, seed, scene) for seed in range(5)]
        results.append(replace(results[0], run=replace(results[0].run, driver="net", scenario="free_road")))
        made.append((planned(scene), study(results, (("a <drive>", "no place"),))))
        adaptive = [drive("net-d", "patch", seed, scene, is_crash=True) for seed in range(5)]
        made.append((planned(f"{scene}-adaptive", is_adaptive=True), study(adaptive)))
        made.append((planned(f"{scene}-twice"), study([drive("truth", "none", seed, scene) for seed in range(5)])))
    return drive_section(made, Path("out"))


def test_drives_of_all_scenes_are_gathered_and_paired() -> None:
    found = {(line.driver, line.scenario, line.patch): line for line in section().lines}
    patch, adaptive = found[NET, "all", "patch"], found[GUARDED, "all", "adaptive patch"]
    assert (patch.crashes.count, patch.crashes.total) == (10, 10) and patch.crashes.interval is not None
    assert patch.crashes.interval[0] == pytest.approx(0.025**0.1)
    assert patch.p("none") == patch.p("random") == pytest.approx(2 / 2**10)
    assert adaptive.crashes.count == 10 and adaptive.p("none") == pytest.approx(2 / 2**10)
    assert found[GUARDED, "all", "patch"].crashes.count == 0
    assert found[TRUTH, "all", "none"].crashes.total == 10, "references of several tasks count once"
    assert found[NET, "free_road", "none"].crashes.total == 2 and found[NET, "all", "none"].crashes.total == 10
    assert patch.impact_mps == pytest.approx(5.0) and found[NET, "all", "none"].impact_mps is None


def test_drives_are_paired_within_their_weather() -> None:
    """The same five situations in two weathers: without a patch the network crashes in one of them, with it in both."""
    made = []
    for weather in ("Clear", "Wet"):
        drives = [drive("net", "none", seed, "a", is_crash=weather == "Wet") for seed in range(5)]
        drives += [drive("net", "patch", seed, "a", is_crash=True) for seed in range(5)]
        made.append((planned("a", weather=weather), study(drives)))
    found = {(line.scenario, line.patch): line for line in drive_section(made, Path("out")).lines}
    assert [found["all", kind].crashes.count for kind in ("none", "patch")] == [5, 10]
    (paired,) = found["all", "patch"].paired
    assert (paired.pairs, paired.only_here, paired.only_there) == (10, 5, 0)


def test_the_weathers_of_a_situation_are_no_further_evidence() -> None:
    """A driver that sees no picture drives alike in every weather; test and interval are those of one weather."""

    def against_none(*weathers: str) -> Paired:
        made = []
        for weather in weathers:
            for scene in ("a", "b", "c"):
                drives = [drive("net", "none", seed, scene) for seed in range(2)]
                drives += [drive("net", "patch", seed, scene, is_crash=scene < "c") for seed in range(2)]
                made.append((planned(scene, weather=weather), study(drives)))
        (line,) = [
            one for one in drive_section(made, Path("out")).lines if (one.scenario, one.patch) == ("all", "patch")
        ]
        return line.paired[0]

    one, three = against_none(""), against_none("Clear", "Wet", "Fog")
    assert (one.pairs, one.only_here, three.pairs, three.only_here) == (6, 4, 18, 12)
    assert one.p == three.p == pytest.approx(2 / 2**4)
    assert one.crash_interval is not None and three.crash_interval == pytest.approx(one.crash_interval)


def test_the_tables_of_the_report() -> None:
    drives = section()
    titles, *rows = drives.rows()
    assert all(len(row) == len(titles) for row in rows)
    assert [row[:4] for row in rows if row[0] == "net<"] == [
        ["net<", "-", "base", "none"], ["net<", "-", "base", "random"], ["net<", "-", "base", "patch"],
        ["net<", "d", "base", "none"], ["net<", "d", "base", "random"], ["net<", "d", "base", "patch"],
        ["net<", "d", "base", "adaptive patch"],
    ]  # fmt: skip
    assert DriveSection().rows() == []
    written = drives.as_json()
    assert all(set(line) == set(COLUMNS) for line in written["lines"])
    assert written["failed"][0] == {"drive": "a <drive>", "problem": "no place"} and len(written["studies"]) == 6


def test_the_table_in_the_papers_layout() -> None:
    table = next(one for one in paper_tables(replace(bench_report(), drives=section())) if one.name == "drives")
    assert table.columns == ("none", "random", "patch", "adaptive patch")
    cells = {(line.scene, line.label): [cell.text for cell in line.cells] for line in table.lines}
    assert cells["net<", "-"] == ["0 % [0, 31]", "0 % [0, 31]", "100 % [69, 100]", ""]
    assert cells["net<", "d"][3] == "100 % [69, 100]" and cells["truth", "-"][1:] == ["", "", ""]
    assert "net&lt;" in paper_table(table) and "net<" not in paper_table(table)
    assert all(one.name != "drives" for one in paper_tables(bench_report()))
