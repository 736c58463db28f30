"""From single samples to datasets, and from datasets to what their patches change."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from gear.contracts.evaluation import Draws
from gear.dataset.reading import Dataset
from gear.verbs.evaluate.report import Difference, Estimate, PairedTest, RowReport, Together
from gear.verbs.evaluate.scoring import Note, Scorer
from gear.verbs.evaluate.spread import Figures, auroc, auroc_interval, bounds, draw, gather, paired_p

NONE = "none"
CONTROLS = (NONE, "random")
"""Patch labels that others are compared with."""


def row_report(
    name: str, dataset: Dataset[Any], scorer: Scorer, notes: list[Note], made: int, seed: int, resamples: int
) -> RowReport:
    """Figures, intervals and costs of one dataset, from its samples' notes."""
    masks = [note.mask for note in notes if note.mask is not None]
    plan = dataset.plan
    # Without a patch there is nothing to be found, only something to be covered by mistake.
    keys = [key for key in (masks[0] if masks else {}) if key == "mask_area" or plan.info.patch_label != NONE]
    return RowReport(
        name=name,
        dataset=dataset.root,
        facts={
            "root": str(dataset.root),
            "town": plan.info.town,
            "scene": plan.info.scene,
            "split": plan.info.split,
            "patch": plan.info.patch_label,
            "content_key": plan.content_key,
            "twin_key": plan.twin_key,
        },
        samples=len(notes),
        made=made,
        figures=_figures(scorer, notes, seed, resamples),
        cost={key: float(np.mean([note.cost[key] for note in notes])) for key in ("model_s", "defense_s")},
        defense={key: _known_mean([mask[key] for mask in masks]) for key in keys},
        per_sample=[{k: v for k, v in note.as_json().items() if k != "facts"} for note in notes],
    )


def together(
    rows: Sequence[RowReport],
    datasets: Sequence[Dataset[Any]],
    scorers: Sequence[Scorer],
    notes: Sequence[list[Note]],
    seed: int,
    resamples: int,
) -> Iterable[Together]:
    """Datasets of several scenes or weathers with patches of one label, as if they were one dataset."""
    members: dict[str, list[int]] = {}
    for number, row in enumerate(rows):
        members.setdefault(row.patch, []).append(number)
    for patch, numbers in members.items():
        options = datasets[numbers[0]].plan.options
        if len(numbers) > 1 and all(datasets[number].plan.options == options for number in numbers):
            every = [note for number in numbers for note in notes[number]]
            yield Together(
                patch=patch,
                rows=tuple(rows[number].name for number in numbers),
                samples=len(every),
                figures=_figures(scorers[numbers[0]], every, seed, resamples),
            )


def _figures(scorer: Scorer, notes: Sequence[Note], seed: int, resamples: int) -> dict[str, dict[str, Estimate]]:
    draws = draw(len(notes), resamples, seed)
    figures = {}
    for report, fresh in scorer.makers.items():
        one = gather(fresh, [note.parts[report] for note in notes], draws)
        figures[report] = {n: Estimate(value=v, interval=one.interval(n)) for n, v in one.overall.items()}
    return figures


def compared(
    rows: Sequence[RowReport],
    datasets: Sequence[Dataset[Any]],
    scorers: Sequence[Scorer],
    notes: Sequence[list[Note]],
    seed: int,
    resamples: int,
) -> Iterable[Difference]:
    """Every patched dataset against its twins without a patch and with a random one."""
    for here, row in enumerate(rows):
        for control in CONTROLS[: CONTROLS.index(row.patch) if row.patch in CONTROLS else len(CONTROLS)]:
            for there, other in enumerate(rows):
                is_twin = datasets[here].plan.twin_key == datasets[there].plan.twin_key
                if other.patch == control and is_twin:
                    count = min(len(notes[here]), len(notes[there]))
                    pair = (notes[here][:count], notes[there][:count])
                    draws = draw(count, resamples, seed)
                    yield Difference(
                        row=row.name,
                        against=other.name,
                        figures={
                            report: _paired(
                                gather(fresh, [note.parts[report] for note in pair[0]], draws),
                                gather(fresh, [note.parts[report] for note in pair[1]], draws),
                            )
                            for report, fresh in scorers[here].makers.items()
                        },
                        auroc=_auroc(*pair, draws),
                        paired={report: _tested(*pair, report, seed) for report in scorers[here].makers},
                    )


def _paired(one: Figures, other: Figures) -> dict[str, Estimate]:
    found = {}
    for name in one.overall:
        if name in other.overall:
            both = name in one.spread and name in other.spread
            interval = bounds(one.spread[name] - other.spread[name]) if both else None
            found[name] = Estimate(value=one.overall[name] - other.overall[name], interval=interval)
    return found


def _tested(here: list[Note], there: list[Note], report: str, seed: int) -> dict[str, PairedTest]:
    """Of every figure that a single sample of the report has."""
    names = list(dict.fromkeys(name for note in here for name in note.figures[report]))
    ours, theirs = (
        np.array([[note.figures[report].get(name, np.nan) for name in names] for note in notes], np.float64)
        for notes in (here, there)
    )
    differences = ours - theirs
    return {
        name: PairedTest(mean=_known_mean(values), p=float(p), pairs=int(np.isfinite(values).sum()))
        for name, values, p in zip(names, differences.T, paired_p(differences, seed), strict=True)
    }


def _auroc(here: list[Note], there: list[Note], draws: Draws) -> Estimate | None:
    high = [note.score for note in here if note.score is not None]
    low = [note.score for note in there if note.score is not None]
    if len(high) != len(here) or len(low) != len(there):
        return None
    return Estimate(value=auroc(high, low), interval=auroc_interval(high, low, draws))


def _known_mean(values: Sequence[float]) -> float:
    known = [value for value in values if value == value]
    return float(np.mean(known)) if known else float("nan")
