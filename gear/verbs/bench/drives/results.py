"""The drives of a benchmark in its report: collision rates by driver, defense and kind of patch, with intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gear.contracts.tasks import NO_PATCH
from gear.driving.statistics import Paired, Rate, compared_pairs
from gear.driving.worker import DriveResult
from gear.values.serial import Json
from gear.verbs.bench.drives.steps import BenchDriver, PlannedDrives
from gear.verbs.bench.plan import ADAPTIVE, PATCH, RANDOM
from gear.verbs.drive.report import ALL, DriveReport
from gear.verbs.drive.table import rate

KINDS = (NO_PATCH, RANDOM, PATCH, ADAPTIVE)
"""Kinds of patches in the order of the columns."""

COLUMNS = (
    "task", "network", "defense", "controller", "scenario", "patch", "drives", "crashes", "collision_rate", "low",
    "high", "impact_mps", "score", "phantom_rate", "p_none", "p_random",
)  # fmt: skip
"""Columns of drives.csv. `p_none` and `p_random` are McNemar's exact test against the twins without a patch and with a
random patch.
"""

Key = tuple[str, BenchDriver, str, str]
"""Task, driver, scenario and kind of patch of the drives in one line."""

Situation = tuple[str, tuple[str, str, str, float, int]]
"""The weather's label, and what `DriveRun.situation` returns."""

TITLES = ("network", "defense", "controller", "patch", "drives", "collision rate", "impact km/h", "score", "p none",
          "p random")  # fmt: skip
"""Titles of the table in the report."""

LEGEND = (
    "drives in the closed loop, over all scenes, weathers and scenarios that are not free roads; collision rate: share"
    " of drives that ended in a crash, with the exact 95 % interval of Clopper and Pearson; impact: mean speed at first"
    " contact; score: CARLA's driving score; p: McNemar's exact test of the crashes against the same situations without"
    " a patch and with a random patch, in which the drives of a situation in several weathers count as one"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveLine:
    """The drives of one driver with one kind of patch over all scenes and weathers, in one scenario or in all.

    Attributes:
        task: name of the task.
        driver: network, defense and controller.
        scenario: name of the scenario; `all` for all scenarios that are not free roads.
        patch: kind of patch, such as `none` or `adaptive patch`.
        crashes, phantoms: shares of drives with a crash, and with a phantom braking.
        impact_mps: mean impact speed of the crashes; None without a crash.
        score: mean driving score.
        paired: comparisons with the kinds `none` and `random`.
    """

    task: str
    driver: BenchDriver
    scenario: str
    patch: str
    crashes: Rate
    phantoms: Rate
    impact_mps: float | None
    score: float
    paired: tuple[Paired, ...]

    def p(self, other: str) -> float | None:
        """The p value against another kind of patch; None if it was not compared."""
        return next((one.p for one in self.paired if one.other == other), None)

    def record(self) -> Mapping[str, Any]:
        """The line as a flat record; the keys are `COLUMNS`, and values that do not exist are None."""
        low, high = self.crashes.interval or (None, None)
        return {
            "task": self.task,
            "network": self.driver.model or "",
            "defense": self.driver.defense or "",
            "controller": self.driver.controller,
            "scenario": self.scenario,
            "patch": self.patch,
            "drives": self.crashes.total,
            "crashes": self.crashes.count,
            "collision_rate": self.crashes.value,
            "low": low,
            "high": high,
            "impact_mps": self.impact_mps,
            "score": self.score,
            "phantom_rate": self.phantoms.value,
            "p_none": self.p(NO_PATCH),
            "p_random": self.p(RANDOM),
        }

    def cells(self) -> list[str]:
        """The cells of the line in the report's table (`TITLES`)."""
        ps = ["" if p is None else f"{p:.2g}" for p in (self.p(NO_PATCH), self.p(RANDOM))]
        impact = "" if self.impact_mps is None else f"{3.6 * self.impact_mps:.0f}"
        first = [self.driver.model or "-", self.driver.defense or "-", self.driver.controller, self.patch]
        return [*first, str(self.crashes.total), rate(self.crashes), impact, f"{self.score:.2f}", *ps]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DriveSection:
    """All drives of a benchmark.

    Attributes:
        lines: one line per driver, scenario and kind of patch.
        studies: folders of the results of `gear.drive`, relative to the folder of the benchmark.
        failed: drives that could not be made: title, and reason.
        made: the planned drives with their results, from which the lines follow.
    """

    lines: tuple[DriveLine, ...] = ()
    studies: tuple[str, ...] = ()
    failed: tuple[tuple[str, str], ...] = ()
    made: tuple[tuple[PlannedDrives, DriveReport], ...] = ()

    def as_json(self) -> Json:
        """The section as JSON: `studies`, `failed`, and `lines` as flat records."""
        return {
            "studies": list(self.studies),
            "failed": [{"drive": title, "problem": problem} for title, problem in self.failed],
            "lines": [dict(line.record()) for line in self.lines],
        }

    def rows(self) -> list[list[str]]:
        """The cells of the report's table: titles, and the lines over all scenarios; empty without drives."""
        rows = [line.cells() for line in self.lines if line.scenario == ALL]
        return [list(TITLES), *rows] if rows else []


def drive_section(made: Sequence[tuple[PlannedDrives, DriveReport]], root: Path) -> DriveSection:
    """Gathers the drives of a benchmark over its scenes and weathers.

    Args:
        made: the planned drives with their results.
        root: folder of the benchmark.
    """
    found: dict[Key, dict[Situation, DriveResult]] = {}
    studies: list[str] = []
    failed: list[tuple[str, str]] = []
    for planned, report in made:
        studies.append(planned.out.relative_to(root).as_posix())
        failed += report.failed
        for one in report.results:
            driver, kind = planned.drivers[one.run.driver], planned.kind(one.run.twin)
            task = planned.task_plugins.name if driver.model else ""
            names = [one.run.scenario] if one.run.scenario in report.free else [one.run.scenario, ALL]
            for name in names:
                group = found.setdefault((task, driver, name, kind), {})
                # References drive again for each task, and count once.
                group.setdefault((planned.weather, one.run.situation), one)
    return DriveSection(
        lines=tuple(_line(key, found) for key in sorted(found, key=lambda key: _order(key, found))),
        studies=tuple(studies),
        failed=tuple(failed),
        made=tuple(made),
    )


def _order(key: Key, groups: Mapping[Key, Any]) -> tuple[int, bool, int]:
    """Drivers in the order of the config, each with its scenarios, all scenarios last, kinds of patches in order."""
    drivers = list(dict.fromkeys((task, driver) for task, driver, _, _ in groups))
    scenarios = list(dict.fromkeys(name for _, _, name, _ in groups if name != ALL))
    task, driver, name, kind = key
    place = len(scenarios) if name == ALL else scenarios.index(name)
    return drivers.index((task, driver)), name == ALL, place * len(KINDS) + KINDS.index(kind)


def _line(key: Key, groups: Mapping[Key, Mapping[Situation, DriveResult]]) -> DriveLine:
    task, driver, scenario, kind = key
    paired = []
    for other in {NO_PATCH: (), RANDOM: (NO_PATCH,)}.get(kind, (NO_PATCH, RANDOM)):
        twins = groups.get((task, driver, scenario, other), {})
        if twins:
            both = [(one, twins[place]) for place, one in groups[key].items() if place in twins]
            paired.append(compared_pairs(both, other))
    here = list(groups[key].values())
    impacts = [one.measures.impact_mps for one in here if one.measures.impact_mps is not None]
    return DriveLine(
        task=task,
        driver=driver,
        scenario=scenario,
        patch=kind,
        crashes=Rate.of(one.measures.is_crash for one in here),
        phantoms=Rate.of(one.measures.phantom_brakings > 0 for one in here),
        impact_mps=sum(impacts) / len(impacts) if impacts else None,
        score=sum(one.measures.score for one in here) / len(here),
        paired=tuple(paired),
    )
