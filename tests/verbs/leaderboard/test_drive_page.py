"""The leaderboard's page about drives."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import gear
from gear.leaderboard.board import tables
from gear.leaderboard.reading import Filed, encoded
from gear.leaderboard.record import Record, digest
from gear.leaderboard.verdict import Verdict
from gear.verbs.leaderboard.drive_page import drive_cells, drive_tables, drives_json
from gear.verbs.leaderboard.pages import drives_page, record_page
from tests.leaderboard.conftest import VALUES, attacking, driving, filed, plugin, record

GOOD = driving(record(), {"none": 0, "random": 0, "patch": 1, "adaptive patch": 2})
BAD = driving(
    record(entry={"defense": plugin("other", package="their-package", version="2")}),
    {"none": 0, "random": 1, "patch": 4, "adaptive patch": 3},
)


def verdict(one: Filed, state: str) -> dict[str, Verdict]:
    made = Verdict(
        record_sha256=one.sha256, state=state, seed=0, repeated=1, fresh=0, environment={}, findings=(),  # type: ignore[arg-type]
    )  # fmt: skip
    return {one.sha256: made}


def test_rows_are_ranked_by_the_worst_known_collision_rate() -> None:
    (table,) = drive_tables(tables([filed(BAD, "b.json"), filed(GOOD), filed(record())], {}))
    assert [row.row.first.record for row in table.rows] == [GOOD, BAD]
    cells = [drive_cells(row, number) for number, row in enumerate(table.rows, start=1)]
    assert cells[0][5:] == [
        "0 % [0, 60]", "0 % [0, 60]", "25 % [1, 81]", "50 % [7, 93]", "50 % [7, 93] (adaptive patch)"
    ]  # fmt: skip
    assert cells[1][2] == "other (their-package 2)" and cells[1][9] == "100 % [40, 100] (patch)"
    assert drives_json([table])[0]["rows"][1]["collisions"]["patch"] == [4, 4]


def test_a_reproduced_attack_of_others_counts_and_an_unchecked_one_does_not() -> None:
    stronger = driving(attacking(record(), 0.6), {"none": 0, "random": 0, "patch": 4})
    own, theirs = filed(GOOD), filed(stronger, "theirs.json")

    def worst(verdicts: dict[str, Verdict]) -> str:
        (table,) = drive_tables(tables([own, theirs], verdicts))
        return drive_cells(table.rows[0], 1)[9]

    assert worst({}) == "50 % [7, 93] (adaptive patch)"
    assert worst(verdict(theirs, "reproduced")) == "100 % [40, 100] (patch, by others)"


def test_other_scenarios_are_another_table() -> None:
    config = dict(GOOD.benchmark.config) | {"drives": {"scenarios": {"cut_in": [20]}, "controllers": {}}}
    moved = dataclasses.replace(GOOD.benchmark, config=config, sha256=digest(config))
    other = dataclasses.replace(GOOD, benchmark=moved)
    assert len(drive_tables(tables([filed(GOOD), filed(other, "o.json")], {}))) == 2


def test_rows_without_all_kinds_and_broken_rows_have_no_rank() -> None:
    partial = driving(record(), {"none": 0, "patch": 0})
    assert not drive_tables(tables([filed(partial)], {}))[0].rows[0].is_ranked
    unadapted = driving(record(), {"none": 0, "random": 0, "patch": 1})
    assert not drive_tables(tables([filed(unadapted)], {}))[0].rows[0].is_ranked, "it has a defense"
    alone = dataclasses.replace(
        unadapted, entry=dataclasses.replace(unadapted.entry, kind="model", defense=None, gradient=None)
    )
    assert drive_tables(tables([filed(alone)], {}))[0].rows[0].is_ranked, "a network alone needs no adaptive patches"
    one = filed(GOOD)
    row = drive_tables(tables([one], verdict(one, "differs")))[0].rows[0]
    assert row.state == "broken" and not row.is_ranked


def test_a_row_that_loses_too_much_on_clean_pictures_has_no_rank() -> None:
    def ranked(clean: float) -> bool:
        made = driving(record(VALUES | {"none": clean}), {"none": 0, "random": 0, "patch": 1, "adaptive patch": 2})
        (row,) = drive_tables(tables([filed(made)], {}))[0].rows
        return row.is_ranked

    assert ranked(0.70) and not ranked(0.60)


def test_the_pages(tmp_path: Path) -> None:
    def write(one: Record, name: str) -> None:
        (tmp_path / "records").mkdir(exist_ok=True)
        (tmp_path / "records" / name).write_bytes(encoded(one))

    write(GOOD, "good.json")
    write(BAD, "bad.json")
    report = gear.build_leaderboard(tmp_path / "records", out=tmp_path / "site")
    page = (tmp_path / "site/drives.html").read_text()
    assert page.index("guard") < page.index("other (their-package 2)") and "<script" not in page
    assert 'href="drives.html"' in (tmp_path / "site/index.html").read_text()
    assert len(report.as_json()["drives"][0]["rows"]) == 2
    shown = record_page(filed(GOOD), None)
    assert "controller of the drives" in shown and "50 % [7, 93]" in shown
    assert "No record has drives" in drives_page([])
