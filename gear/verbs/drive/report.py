"""The results of a study in the closed loop: rows of drives, exact intervals, and paired tests between twins."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from gear.contracts.tasks import NO_PATCH, RANDOM_PATCH
from gear.driving.statistics import Paired, Rate, compared, mean_known
from gear.driving.worker import DriveResult
from gear.values.serial import Json, to_json
from gear.verbs.drive.metric_against_outcome import MetricLoss, auroc, metric_losses


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """All drives of one driver, scenario and twin, over all places, speeds and seeds.

    Attributes:
        driver, scenario, twin: what the drives have in common.
        speed_kmh: their speed; None for all speeds together.
        crashes: share of drives that ended in a crash.
        impact_mps: mean impact speed of the crashes; None without a crash.
        least_distance_m: mean of the least distances; None if no road user was there.
        least_ttc_s: mean of the least times to collision; None if nothing was approached.
        phantoms: share of drives with a phantom braking.
        off_road: share of drives that left the lane.
        ran_red_light: share of drives that ran a red light.
        lateral_peak_m: mean of the largest distances from the centre line.
        jerk_rms_mps3: mean of the root mean square jerks.
        score: mean driving score.
        open_loop: mean of the task's main metric over the frames of each drive; None if predictions were not evaluated.
        open_loop_metric: name of that metric.
        paired: comparisons with the twins `none` and `random`.
    """

    driver: str
    scenario: str
    twin: str
    speed_kmh: float | None
    crashes: Rate
    impact_mps: float | None
    least_distance_m: float | None
    least_ttc_s: float | None
    phantoms: Rate
    off_road: Rate
    ran_red_light: Rate
    lateral_peak_m: float
    jerk_rms_mps3: float
    score: float
    open_loop: float | None = None
    open_loop_metric: str = ""
    paired: tuple[Paired, ...] = ()


Key = tuple[str, str, str, float | None]
"""Driver, scenario, twin and speed of a row."""

Groups = dict[Key, list[DriveResult]]
ALL = "all"
"""Name of the row over all scenarios that have something in the way."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DriveReport:
    """The results of all drives of a study.

    Attributes:
        out: folder of the results.
        results: the result of each drive.
        failed: drives that could not be made: title of the drive, and the reason.
        facts: config and versions, as JSON.
        free: names of the scenarios without anything in the way.
        errors: drivers whose task's main metric is an error, so that a larger value is worse.
    """

    out: Path
    results: tuple[DriveResult, ...]
    failed: tuple[tuple[str, str], ...]
    facts: Json
    free: frozenset[str] = frozenset()
    errors: frozenset[str] = frozenset()

    def losses(self) -> dict[str, list[MetricLoss]]:
        """The metric lost by each drive with a patch, beside its outcome, by driver; drivers whose predictions were not
        evaluated are left out.
        """
        found: dict[str, list[MetricLoss]] = {}
        for one in metric_losses(self.results, self.errors):
            found.setdefault(one.driver, []).append(one)
        return found

    def rows(self) -> list[Row]:
        """One row for each driver, scenario and twin, and one for each driver and twin over all scenarios that are not
        free roads.
        """
        return self._grouped(lambda one: (one.run.driver, one.run.scenario, one.run.twin, None))

    def by_speed(self) -> list[Row]:
        """One row for each driver, twin and speed, over all scenarios that are not free roads."""
        return self._grouped(lambda one: (one.run.driver, ALL, one.run.twin, one.run.speed_kmh), with_free=False)

    def as_json(self) -> Json:
        """The report as JSON, with the keys `facts`, `rows`, `by_speed`, `metric_against_outcome` (by driver:
        `auroc`, and the metric lost by each drive with a patch), `drives` (run, measures and hashes of each drive) and
        `failed` (`drive` and `problem`).
        """
        return {
            "facts": self.facts,
            "rows": [_known(to_json(row)) for row in self.rows()],
            "by_speed": [_known(to_json(row)) for row in self.by_speed()],
            "metric_against_outcome": {
                driver: {"auroc": auroc(losses), "drives": [to_json(one) for one in losses]}
                for driver, losses in self.losses().items()
            },
            "drives": [to_json(one) for one in self.results],
            "failed": [{"drive": title, "problem": problem} for title, problem in self.failed],
        }

    def _grouped(self, key: Callable[[DriveResult], Key], *, with_free: bool = True) -> list[Row]:
        groups: Groups = {}
        for one in self.results:
            driver, scenario, twin, speed_kmh = key(one)
            names = {scenario} if with_free else set()
            if one.run.scenario not in self.free:
                names.add(ALL)
            for name in sorted(names):
                groups.setdefault((driver, name, twin, speed_kmh), []).append(one)
        scenarios = list(dict.fromkeys(name for _, name, _, _ in groups if name != ALL))
        drivers = list(dict.fromkeys(driver for driver, _, _, _ in groups))
        order = {name: number for number, name in enumerate([*scenarios, ALL])}
        keys = sorted(groups, key=lambda one: (drivers.index(one[0]), order[one[1]], one[3] or 0.0))
        return [_row(one, groups) for one in keys]


def _row(
    key: tuple[str, str, str, float | None], groups: dict[tuple[str, str, str, float | None], list[DriveResult]]
) -> Row:
    driver, scenario, twin, speed_kmh = key
    here = groups[key]
    measures = [one.measures for one in here]
    others = [NO_PATCH] if twin == RANDOM_PATCH else [] if twin == NO_PATCH else [NO_PATCH, RANDOM_PATCH]
    paired = [
        compared(here, groups[driver, scenario, other, speed_kmh], other)
        for other in others
        if (driver, scenario, other, speed_kmh) in groups
    ]
    return Row(
        driver=driver,
        scenario=scenario,
        twin=twin,
        speed_kmh=speed_kmh,
        crashes=Rate.of(one.is_crash for one in measures),
        impact_mps=mean_known(one.impact_mps for one in measures),
        least_distance_m=mean_known(one.least_distance_m for one in measures),
        least_ttc_s=mean_known(one.least_ttc_s for one in measures),
        phantoms=Rate.of(one.phantom_brakings > 0 for one in measures),
        off_road=Rate.of(one.off_road_share > 0 for one in measures),
        ran_red_light=Rate.of(one.ran_red_light for one in measures),
        lateral_peak_m=mean_known(one.lateral_peak_m for one in measures) or 0.0,
        jerk_rms_mps3=mean_known(one.jerk_rms_mps3 for one in measures) or 0.0,
        score=mean_known(one.score for one in measures) or 0.0,
        open_loop=mean_known(one.open_loop.get(one.open_loop_metric) for one in here),
        open_loop_metric=here[0].open_loop_metric,
        paired=tuple(paired),
    )


def _known(value: Json) -> Json:
    """The same JSON with null for NaN."""
    if isinstance(value, dict):
        return {key: _known(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_known(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
