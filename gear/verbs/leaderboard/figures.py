"""Compares the ranked figures of a record with figures that are computed again."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from gear.leaderboard.record import Figure, Record
from gear.leaderboard.rules import is_transfer
from gear.leaderboard.verdict import Finding, Level, finding
from gear.verbs.leaderboard.rerun import Again

MOST_FIGURE_OFF = 0.02
"""Largest difference of a figure between machines that differ; relative for figures above 1."""

ROUNDING = 1e-6
"""Largest difference of a mean from the same values in another order; relative for means above 1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """The result of comparing a record's figures with figures that were measured again.

    Attributes:
        findings: one line per figure.
        is_whole: whether every ranked figure was computed again, except those with patches of other networks, which a
            record does not hold.
    """

    findings: tuple[Finding, ...]
    is_whole: bool


def compare_figures(
    record: Record, again: Sequence[Again], ranked: Callable[[Sequence[Again]], float | None], *, is_same: bool
) -> Compared:
    """Compares the ranked metric of every kind of patch.

    A figure is computed again from the predictions if every sample of its kind was measured again. Otherwise, a metric
    that is the mean of the samples' values is compared with the mean of the record's values, of which the check
    measured some again. Any other metric, such as a mean IoU, depends on all samples together and is not compared.

    Args:
        record: the record.
        again: samples that were measured again.
        ranked: computes the ranked metric over some samples; None where it is undefined.
        is_same: whether this machine should give equal bytes; a figure of equal predictions must then be equal.
    """
    claimed = {(record.data[one.data].patch, one.index, one.sha256) for one in record.samples}
    found: list[Finding] = []
    is_whole = True
    is_mean = _is_mean(record, again, ranked)
    for kind in record.kinds():
        figure, here = record.figure(kind), [one for one in again if one.patch == kind]
        name = f"{kind}: {record.entry.metric}"
        if figure is None:
            continue
        if not here and is_transfer(kind):
            found.append(finding("note", f"{name} was not computed again: the patches belong to another network"))
        elif not here:
            found.append(finding("differs", f"{name} is claimed, but the record's config makes no such pictures"))
        elif len(here) == figure.n:
            is_equal = is_same and all((kind, one.index, one.sha256) in claimed for one in here)
            most_off = ROUNDING if is_equal else MOST_FIGURE_OFF
            found.append(_compared(name, f"of all {figure.n} samples", figure, ranked(here), most_off))
        elif is_mean:
            found.append(_compared(name, "as the mean of the record's samples", figure, _mean(record, kind), ROUNDING))
        else:
            is_whole = False
            text = f"was not computed again: it needs all {figure.n} samples, {len(here)} were measured"
            found.append(finding("note", f"{name} {text}; raise --samples (and --most-pictures)"))
    return Compared(findings=tuple(found), is_whole=is_whole)


def compare_reference(
    record: Record, alone: Sequence[Again], ranked: Callable[[Sequence[Again]], float | None]
) -> Iterator[Finding]:
    """Yields one finding for each ranked figure of the network without its defense.

    Args:
        record: the record.
        alone: samples that were measured again without the defense: all samples, or none.
        ranked: computes the ranked metric over some samples; None where it is undefined.
    """
    if record.entry.defense is None or not record.reference:
        return
    for kind in record.kinds():
        figure, here = record.figure(kind, is_reference=True), [one for one in alone if one.patch == kind]
        name = f"without the defense, {kind}: {record.entry.metric}"
        if figure is not None and here:
            yield _compared(name, f"of all {len(here)} samples", figure, ranked(here), MOST_FIGURE_OFF)
    if not alone:
        yield finding("note", "the figures of the network without the defense were not computed again")


def _compared(name: str, what: str, figure: Figure, value: float | None, most_off: float) -> Finding:
    assert figure.value is not None
    if value is None:
        return finding("differs", f"{name} {what} is undefined, the record says {figure.value:.4f}")
    level: Level = "differs" if abs(value - figure.value) > most_off * max(1.0, abs(figure.value)) else "same"
    return finding(level, f"{name} {what} is {value:.4f}, the record says {figure.value:.4f}")


def _mean(record: Record, kind: str) -> float | None:
    """The mean of the values that a record states for the samples with one kind of patch; None without values."""
    values = [one.value for one in record.samples if record.data[one.data].patch == kind and one.value is not None]
    return float(np.mean(values)) if values else None


def _is_mean(record: Record, again: Sequence[Again], ranked: Callable[[Sequence[Again]], float | None]) -> bool:
    """Whether the ranked metric of the measured samples is the mean of their values.

    An evaluator does not say how it combines samples, so this is seen from values that are not all equal.
    """
    values = [one.value for one in again if one.value is not None]
    if record.sample_metric != record.entry.metric or len(set(values)) < 2:
        return False
    value, mean = ranked(again), float(np.mean(values))
    return value is not None and abs(value - mean) <= ROUNDING * max(1.0, abs(mean))
