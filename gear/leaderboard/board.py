"""The leaderboard: records grouped to rows, each with its state, its worst known figure, its faults and warnings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from gear.leaderboard.reading import Filed
from gear.leaderboard.record import Figure
from gear.leaderboard.rules import faults, harm, is_transfer, robust_figures, warnings, worst
from gear.leaderboard.verdict import Verdict

State = Literal["claimed", "reproduced", "broken"]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Row:
    """One row: a network, alone or behind a defense, in one benchmark.

    Attributes:
        own: records of the entry that count, one per seed and attack.
        attacks: reproduced attacks of other people on this row.
        waiting: attacks of other people that nobody has reproduced yet; they do not count.
        state: `claimed`, `reproduced` by a check, or `broken`.
        worst: the worst known value of the ranked metric under an optimised patch, with the record that it comes from;
            None if there is none.
        faults: why the row is not ranked; empty for a ranked row.
        warnings: signs that the attacks were too weak.
    """

    own: tuple[Filed, ...]
    attacks: tuple[Filed, ...]
    waiting: tuple[Filed, ...]
    state: State
    worst: tuple[Figure, Filed] | None
    faults: tuple[str, ...]
    warnings: tuple[str, ...]

    @property
    def first(self) -> Filed:
        """The record from which the row's names and its values on clean pictures are taken."""
        return self.own[0]

    @property
    def is_ranked(self) -> bool:
        """Whether the row has a rank."""
        return self.worst is not None and not self.faults and self.state != "broken"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Table:
    """The rows of one task in one benchmark; their numbers are comparable.

    Attributes:
        benchmark, data_key: name of the benchmark, and hash of its scenes, weathers and numbers of pictures.
        task, metric: the task and its ranked metric.
        lower_is_better: whether the metric is an error.
        rows: ranked rows, best first, followed by the other rows.
    """

    benchmark: str
    data_key: str
    task: str
    metric: str
    lower_is_better: bool
    rows: tuple[Row, ...]


def tables(records: Iterable[Filed], verdicts: Mapping[str, Verdict]) -> list[Table]:
    """Groups records to tables and rows.

    Args:
        records: records that were read.
        verdicts: verdicts of checks by the SHA-256 of the record.

    Returns:
        The tables, one per benchmark, task and ranked metric; their rows have state, faults and warnings.
    """
    grouped: dict[tuple[str, str, str, bool], list[Filed]] = {}
    for one in records:
        entry = one.record.entry
        key = (one.record.benchmark.data_key, entry.task, entry.metric, entry.lower_is_better)
        grouped.setdefault(key, []).append(one)
    found = []
    for (data_key, task, metric, less), members in sorted(grouped.items(), key=lambda item: item[0]):
        rows: dict[tuple[object, ...], list[Filed]] = {}
        for one in members:
            rows.setdefault(one.record.entry.row, []).append(one)
        made = [row for one in rows.values() if (row := _row(one, verdicts, lower_is_better=less)) is not None]
        found.append(
            Table(
                benchmark=members[0].record.benchmark.name,
                data_key=data_key,
                task=task,
                metric=metric,
                lower_is_better=less,
                rows=tuple(sorted(made, key=lambda row: _order(row, lower_is_better=less))),
            )
        )
    return found


def _order(row: Row, *, lower_is_better: bool) -> tuple[bool, float, str]:
    value = 0.0 if row.worst is None or row.worst[0].value is None else row.worst[0].value
    return not row.is_ranked, value if lower_is_better else -value, row.first.sha256


def _row(members: Sequence[Filed], verdicts: Mapping[str, Verdict], *, lower_is_better: bool) -> Row | None:
    """Makes the row of records with the same network and defense; None if there are only attacks of other people."""

    def state(one: Filed) -> str:
        return verdicts[one.sha256].state if one.sha256 in verdicts else "claimed"

    own = [one for one in members if one.record.entry.kind != "attack"]
    if not own:
        return None
    reproduced = [one for one in own if state(one) == "reproduced"]
    standing = [one for one in own if state(one) != "differs"]
    counted = reproduced or standing or own
    foreign = [one for one in members if one.record.entry.kind == "attack"]
    attacks = [one for one in foreign if state(one) == "reproduced"]
    figures = [(figure, one) for one in counted for figure in robust_figures(one.record)]
    # No check can measure the patches of other networks again, so they count only against their own author.
    figures += [(f, one) for one in attacks for f in robust_figures(one.record) if not is_transfer(f.patch)]
    lowest = worst([figure for figure, _ in figures], lower_is_better=lower_is_better)
    found = next(((figure, one) for figure, one in figures if figure is lowest), None)
    is_broken = not standing or (found is not None and found[1] in attacks and _gains_nothing(found, counted[0]))
    return Row(
        own=tuple(counted),
        attacks=tuple(attacks),
        waiting=tuple(one for one in foreign if state(one) == "claimed"),
        state="broken" if is_broken else "reproduced" if reproduced else "claimed",
        worst=found,
        faults=tuple(faults([one.record for one in counted])),
        warnings=tuple(warnings([one.record for one in counted], [one.record for one in attacks])),
    )


def _gains_nothing(found: tuple[Figure, Filed], own: Filed) -> bool:
    """Whether an attack leaves the defended network no better than the network alone is under its own patch."""
    alone = [one for one in own.record.reference if one.name == own.record.entry.metric and one.value is not None]
    attacked = [one for one in alone if one.patch not in ("none", "random")]
    lowest = worst(attacked, lower_is_better=own.record.entry.lower_is_better)
    return lowest is not None and harm(own.record, found[0], lowest) >= 0
