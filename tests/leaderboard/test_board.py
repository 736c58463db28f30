"""Ranks and states: the worst known figure counts, and nobody's word about himself."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from gear.leaderboard.board import Row, tables
from gear.leaderboard.record import Record
from gear.leaderboard.verdict import Verdict
from tests.leaderboard.conftest import VALUES, attacking, benchmark, filed, plugin, record


def verdict(one: Record, state: Any = "reproduced") -> dict[str, Verdict]:
    sha256 = filed(one).sha256
    made = Verdict(record_sha256=sha256, state=state, seed=0, repeated=1, fresh=0, environment={}, findings=())
    return {sha256: made}


def rows(records: Iterable[Record], verdicts: dict[str, Verdict] | None = None) -> list[Row]:
    (table,) = tables([filed(one) for one in records], verdicts or {})
    return list(table.rows)


def value(row: Row) -> float | None:
    return None if row.worst is None else row.worst[0].value


def test_rows_are_ranked_by_their_worst_figure() -> None:
    better = record({**VALUES, "adaptive patch": 0.55}, entry={"defense": plugin("better")})
    faulty = record(entry={"defense": plugin("faulty"), "is_random": True})
    found = rows([record(), faulty, better])
    assert [row.first.record.entry.defense.name for row in found if row.first.record.entry.defense] == [
        "better", "guard", "faulty",
    ]  # fmt: skip
    assert [value(row) for row in found[:2]] == [0.55, 0.50]
    assert [row.is_ranked for row in found] == [True, True, False] and found[0].state == "claimed"


def test_an_attack_of_others_counts_when_it_is_reproduced() -> None:
    own, other = record(), attacking(record(), 0.4)
    (row,) = rows([own, other])
    assert value(row) == 0.5 and len(row.waiting) == 1
    (row,) = rows([own, other], verdict(other))
    assert value(row) == 0.4 and row.state == "claimed" and row.worst is not None
    assert row.worst[1].record.entry.kind == "attack"
    (row,) = rows([own, attacking(record(), 0.25)], verdict(attacking(record(), 0.25)))
    assert row.state == "broken" and not row.is_ranked, "no better than the network alone, which keeps 0.30"


def test_only_verdicts_change_states() -> None:
    (row,) = rows([record()], verdict(record()))
    assert row.state == "reproduced"
    (row,) = rows([record()], verdict(record(), "differs"))
    assert row.state == "broken"


def test_a_forged_record_of_a_reproduced_row_does_not_count() -> None:
    forged = record({**VALUES, "adaptive patch": 0.1})
    (row,) = rows([record(), forged], verdict(record()))
    assert value(row) == 0.5


def test_other_data_make_another_table() -> None:
    other = replace(record(), benchmark=benchmark(weathers=[{"preset": "Night"}]))
    assert len(tables([filed(record()), filed(other)], {})) == 2


def test_an_attack_alone_makes_no_row() -> None:
    assert rows([attacking(record(), 0.1)]) == []


def test_a_record_that_turns_the_metric_around_is_ranked_apart() -> None:
    turned = record(entry={"lower_is_better": True, "defense": plugin("turned")})
    worse = record({**VALUES, "adaptive patch": 0.1}, entry={"defense": plugin("worse")})
    found = tables([filed(turned), filed(record()), filed(worse)], {})
    assert [(table.lower_is_better, len(table.rows)) for table in found] == [(False, 2), (True, 1)]
    assert [value(row) for row in found[0].rows] == [0.5, 0.1]


def test_patches_of_other_networks_count_only_against_their_author() -> None:
    own, other = record(), attacking(record({**VALUES, "patch of other": 0.01}), 0.55)
    (row,) = rows([own, other], verdict(other))
    assert value(row) == 0.5 and row.state == "claimed"
    (row,) = rows([record({**VALUES, "patch of other": 0.01})])
    assert value(row) == 0.01
