"""Cells of the leaderboard's tables."""

from __future__ import annotations

from gear.leaderboard.board import tables
from gear.leaderboard.verdict import Verdict
from gear.verbs.leaderboard.texts import ATTACKS, BY_KNOWLEDGE, HEAD, attack_rows, defense_cells, knowledge_rows, named
from tests.leaderboard.conftest import VALUES, attacking, filed, plugin, record


def test_cells_fit_their_titles() -> None:
    alone = record(
        {"none": 0.7, "random": 0.6, "patch": 0.4, "patch of other": 0.5}, reference=(),
        entry={"kind": "model", "defense": None, "gradient": None},
    )  # fmt: skip
    (table,) = tables([filed(record()), filed(alone)], {})
    cells = defense_cells(table.rows[0], 1)
    assert len(cells) == len(HEAD) and cells[0] == "1" and cells[4] == "0.700 [0.680, 0.720]"
    assert cells[8] == "0.500 [0.480, 0.520] (adaptive patch, eot)"
    (attack,) = attack_rows(table)
    assert len(attack) == len(ATTACKS) and attack[2:4] == ["white-box", "100 steps"]
    assert attack[-1] == "other: 0.500 [0.480, 0.520]"


def test_figures_by_knowledge() -> None:
    black = attacking(record(), 0.45, knowledge="black-box", steps=0, queries=10)
    one, other = filed(record()), filed(black)
    (table,) = tables([one, other], {})
    (cells,) = knowledge_rows(table)
    assert len(cells) == len(BY_KNOWLEDGE) and cells[2:] == ["0.500 [0.480, 0.520]", ""], (
        "nobody has checked the attack"
    )


def test_transfer_of_others_is_no_figure_of_the_row() -> None:
    transfer = attacking(record({**VALUES, "patch of other": 0.01}), 0.45, knowledge="black-box", steps=0, queries=10)
    one, other = filed(record()), filed(transfer)
    made = Verdict(
        record_sha256=other.sha256, state="reproduced", seed=0, repeated=1, fresh=0, environment={}, findings=()
    )
    (table,) = tables([one, other], {other.sha256: made})
    (cells,) = knowledge_rows(table)
    assert cells[3] == "0.450 [0.450, 0.450]", "no check can measure the patches of other networks"


def test_plugins_of_others_are_named_with_their_package() -> None:
    assert named(None) == "-" and named(plugin("lgs")) == "lgs"
    assert named(plugin("lgs", package="theirs", version="2")) == "lgs (theirs 2)"
