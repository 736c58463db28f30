"""The tables of the CARLA-GeAR paper: AUROC by scene (Table 1), and clean and adversarial performance relative to the
undefended clean network by scene (Table 2).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from gear.contracts.tasks import NO_PATCH
from gear.verbs.bench.drives.results import KINDS, LEGEND, DriveSection
from gear.verbs.bench.plan import ADAPTIVE, PATCH
from gear.verbs.bench.report import BenchReport, Result, TaskResult
from gear.verbs.drive.report import ALL
from gear.verbs.drive.table import rate
from gear.verbs.evaluate.report import RowReport

Tone = Literal["", "reference", "worse", "better", "same"]
"""How a cell is shown: bold reference, red for worse, green for better, blue for no effect, as in the paper."""

SAME = 5e-5
"""Difference of a metric up to which a defense counts as without effect: it is printed as 0.00 points."""

MEAN = "mean"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One cell of a table.

    Attributes:
        text: the number; empty where it was not measured.
        tone: how the number is shown.
        is_grey: whether the cell belongs to a column of attacked pictures, which the paper shades.
    """

    text: str
    tone: Tone = ""
    is_grey: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One line of a table.

    Attributes:
        scene: name of the scene.
        label: name of the detector or defense; `-` for none.
        cells: cells in the order of the columns.
    """

    scene: str
    label: str
    cells: tuple[Cell, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperTable:
    """A table in the paper's layout.

    Attributes:
        name: file name without an ending.
        caption: what the table shows, and how to read it.
        tasks: (task, number of its columns), from left to right.
        columns: titles of the columns below the tasks.
        lines: lines, grouped by scene.
    """

    name: str
    caption: str
    tasks: tuple[tuple[str, int], ...]
    columns: tuple[str, ...]
    lines: tuple[Line, ...]


def paper_tables(report: BenchReport) -> list[PaperTable]:
    """Returns the tables of the CARLA-GeAR paper for a benchmark: Table 1, Table 2, and Table 2 for adaptive patches if
    there are any; and, in the same layout, the collision rates of the drives. Tables without any number are left out.

    Args:
        report: results of the benchmark.
    """
    found = [_detection(report), _defense(report, PATCH, "table2")]
    pools = (pool for task in report.tasks for one in task.results for pool in one.evaluation.pools)
    found += [_defense(report, ADAPTIVE, "table2-adaptive")] if any(pool.name == ADAPTIVE for pool in pools) else []
    found += [] if report.drives is None else [_collisions(report.drives)]
    return [table for table in found if any(cell.text for line in table.lines for cell in line.cells)]


def _collisions(section: DriveSection) -> PaperTable:
    """Collision rates over all scenes: one line per network and defense, one column per kind of patch."""
    lines = [line for line in section.lines if line.scenario == ALL]
    kinds = [kind for kind in KINDS if any(line.patch == kind for line in lines)]
    found = {(line.task, line.driver, line.patch): line for line in lines}
    return PaperTable(
        name="drives",
        caption=f"Collision rates by network, defense and kind of patch: {LEGEND}.",
        tasks=(("collision rate", len(kinds)),),
        columns=tuple(kinds),
        lines=tuple(
            Line(
                scene=driver.model or driver.controller,
                label=driver.defense or "-",
                cells=tuple(
                    Cell(
                        text=rate(found[task, driver, kind].crashes) if (task, driver, kind) in found else "",
                        is_grey=kind in (PATCH, ADAPTIVE),
                    )
                    for kind in kinds
                ),
            )
            for task, driver in dict.fromkeys((line.task, line.driver) for line in lines)
        ),
    )


def scenes_of(report: BenchReport) -> list[str]:
    """Returns the names of the scenes of a benchmark in the order of the datasets of a pool; with several weathers,
    scene and weather.

    Args:
        report: results of the benchmark.
    """
    weathers = report.facts["weathers"]
    several = len(weathers) > 1
    return [f"{scene} {weather}" if several else scene for scene in report.facts["scenes"] for weather in weathers]


def row_of(one: Result, patch: str, place: int) -> RowReport | None:
    """Returns the results in one scene with one kind of patch; None if it was not measured.

    Args:
        one: results of a network.
        patch: kind of patch, such as `none`, `random` or `patch`.
        place: position of the scene (with its weather) in the benchmark.
    """
    pool = next((each for each in one.evaluation.pools if each.name == patch), None)
    if pool is None:
        return None
    return next(row for row in one.evaluation.rows if row.name == pool.rows[place])


def auroc_of(one: Result, patch: str, place: int) -> float | None:
    """Returns the AUROC of a defense's score in one scene, of pictures with a patch against those without one.

    Args:
        one: results of a network with a defense.
        patch: kind of patch, such as `patch` or `random`.
        place: position of the scene (with its weather) in the benchmark.

    Returns:
        The area in 0..1; None without scores or without one of the two datasets.
    """
    here, there = row_of(one, patch, place), row_of(one, NO_PATCH, place)
    if here is None or there is None:
        return None
    pairs = (each for each in one.evaluation.differences if (each.row, each.against) == (here.name, there.name))
    found = next(pairs, None)
    return None if found is None or found.auroc is None else found.auroc.value


def _detection(report: BenchReport) -> PaperTable:
    networks = [(task, model) for task in report.tasks for model in _models(task)]
    detectors = list(dict.fromkeys(
        one.defense for task in report.tasks for one in task.results
        if one.defense is not None and any(auroc_of(one, PATCH, n) is not None for n in range(len(scenes_of(report))))
    ))  # fmt: skip
    lines = []
    places = list(enumerate(scenes_of(report)))
    for place, scene in [*places, (-1, MEAN)]:
        for detector in detectors:
            values = [
                _auroc_cell(_result(task, model, detector), [place] if place >= 0 else [n for n, _ in places])
                for task, model in networks
            ]
            lines.append(Line(scene=scene, label=detector, cells=tuple(values)))
    return PaperTable(
        name="table1",
        caption=(
            "Area under the ROC curve (AUROC) of each detector's score, by scene: how well the score separates "
            "pictures with an optimised patch from the same pictures without a patch (1: perfectly, 0.5: by chance)."
        ),
        tasks=tuple((task.name, len(_models(task))) for task in report.tasks),
        columns=tuple(model for _, model in networks),
        lines=tuple(lines),
    )


def _auroc_cell(one: Result | None, places: Sequence[int]) -> Cell:
    values = [] if one is None else [auroc_of(one, PATCH, place) for place in places]
    known = [value for value in values if value is not None and value == value]
    return Cell(text=f"{sum(known) / len(known):.2f}" if known else "")


def _defense(report: BenchReport, attacked: str, name: str) -> PaperTable:
    """Makes Table 2: for each network one column without patches and one with patches of the kind `attacked`."""
    networks = [(task, model) for task in report.tasks for model in _models(task)]
    defenses = list(dict.fromkeys(
        one.defense for task in report.tasks for one in task.results
        if one.defense is None or one.changes_pictures
    ))  # fmt: skip
    lines = []
    for place, scene in enumerate(scenes_of(report)):
        for defense in defenses:
            cells = [cell for task, model in networks for cell in _pair(task, model, defense, place, attacked)]
            lines.append(Line(scene=scene, label=defense or "-", cells=tuple(cells)))
    kind = "adaptive patches" if attacked == ADAPTIVE else "optimised patches"
    return PaperTable(
        name=name,
        caption=(
            f"Performance without patches (white columns) and with {kind} (grey columns), by scene. Bold: the metric "
            "of the undefended network without patches; every other number is the difference to it. Green, red, blue: "
            "the defense is better than, worse than, or the same as no defense. Metrics in 0..1 are in points "
            "(hundredths)."
        ),
        tasks=tuple((f"{task.name}{_unit(task)}", 2 * len(_models(task))) for task in report.tasks),
        columns=tuple(title for _, model in networks for title in (model, "attacked")),
        lines=tuple(lines),
    )


def _unit(task: TaskResult) -> str:
    return "" if task.metric is None else f" ({task.metric.title})"


def _pair(task: TaskResult, model: str, defense: str | None, place: int, attacked: str) -> Iterator[Cell]:
    """Yields the cells of one network without and with patches."""
    bare, guarded = _result(task, model, None), _result(task, model, defense)
    clean = _value(task, bare, NO_PATCH, place)
    for patch in (NO_PATCH, attacked):
        # Adaptive patches exist only behind a defense; without one, the patches against the network count.
        plain = PATCH if patch == ADAPTIVE else patch
        here = _value(task, guarded, plain if defense is None else patch, place)
        there = _value(task, bare, plain, place)
        is_grey = patch != NO_PATCH
        if here is None or clean is None or there is None:
            yield Cell(text="", is_grey=is_grey)
        elif defense is None and patch == NO_PATCH:
            yield Cell(text=f"{_scale(task) * here:.2f}", tone="reference")
        else:
            tone = "" if defense is None else _tone(task, here, there)
            yield Cell(text=f"{_scale(task) * (here - clean):+.2f}", tone=tone, is_grey=is_grey)


def _tone(task: TaskResult, here: float, there: float) -> Tone:
    if abs(here - there) < SAME:
        return "same"
    assert task.metric is not None
    return "better" if (here < there) == task.metric.lower_is_better else "worse"


def _scale(task: TaskResult) -> float:
    return 1.0 if task.metric is None or task.metric.lower_is_better else 100.0


def _value(task: TaskResult, one: Result | None, patch: str, place: int) -> float | None:
    row = None if one is None else row_of(one, patch, place)
    found = None if row is None or task.metric is None else task.metric.among(row.metrics)
    return None if found is None or found.value != found.value else found.value


def _models(task: TaskResult) -> list[str]:
    return list(dict.fromkeys(one.model for one in task.results))


def _result(task: TaskResult, model: str, defense: str | None) -> Result | None:
    return next((one for one in task.results if (one.model, one.defense) == (model, defense)), None)
