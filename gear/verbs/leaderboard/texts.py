"""Texts and JSON of the leaderboard's tables, without HTML."""

from __future__ import annotations

from collections.abc import Sequence

from gear.leaderboard.board import Row, Table
from gear.leaderboard.record import Figure, Plugin, Record
from gear.leaderboard.rules import ADAPTIVE, NONE, PATCH, RANDOM, is_transfer
from gear.values.serial import Json, to_json

HEAD = (
    "rank", "network", "defense", "state", "clean", "random", "patch", "adaptive", "worst known", "AUROC", "s/picture",
)  # fmt: skip
"""Column titles of the table of defenses."""

ATTACKS = ("network", "attack", "knowledge", "effort", "random", "patch", "transfer")
"""Column titles of the table of attacks on networks without a defense."""

BY_KNOWLEDGE = ("network", "defense", "white-box", "black-box")
"""Column titles of the table of attacks by knowledge."""


def named(plugin: Plugin | None) -> str:
    """Name of a plugin with its package, if it is not one of gear's own, and its version; `-` for none."""
    if plugin is None:
        return "-"
    own = plugin.package == "mujoco-gear"
    return plugin.name if own else f"{plugin.name} ({plugin.package} {plugin.version})"


def shown(figure: Figure | None) -> str:
    """A number of a record with its 95 % interval as text; empty for None."""
    if figure is None or figure.value is None:
        return ""
    if figure.low is None or figure.high is None:
        return f"{figure.value:.3f}"
    return f"{figure.value:.3f} [{figure.low:.3f}, {figure.high:.3f}]"


def defense_cells(row: Row, rank: int | None) -> list[str]:
    """The cells of one row in the table of defenses.

    Args:
        row: the records of one network with one defense.
        rank: position in the table, from 1; None for rows that are not ranked.
    """
    record = row.first.record
    auroc = record.figure(ADAPTIVE, "auroc") or record.figure(PATCH, "auroc")
    lowest = "" if row.worst is None else f"{shown(row.worst[0])} {_origin(row)}"
    return [
        "" if rank is None else str(rank),
        named(record.entry.network),
        named(record.entry.defense),
        row.state,
        *(shown(record.figure(kind)) for kind in (NONE, RANDOM, PATCH, ADAPTIVE)),
        lowest,
        shown(auroc),
        f"{sum(record.cost_s.values()):.3f}",
    ]


def _origin(row: Row) -> str:
    assert row.worst is not None
    figure, filed = row.worst
    attack = named(filed.record.attack.plugin)
    return f"({figure.patch}, {attack})" if filed in row.own else f"({figure.patch}, {attack}, by others)"


def attack_rows(table: Table) -> list[list[str]]:
    """The cells of the table of attacks: one line per network and attack, with transfer from other networks."""
    lines = []
    for row in table.rows:
        if row.first.record.entry.defense is not None:
            continue
        for filed in (*row.own, *row.attacks):
            record = filed.record
            transfer = [f"{kind.removeprefix('patch of ')}: {shown(record.figure(kind))}" for kind in record.kinds()
                        if kind.startswith("patch of ")]  # fmt: skip
            lines.append([
                named(record.entry.network),
                named(record.attack.plugin),
                record.attack.knowledge,
                _effort(record),
                shown(record.figure(RANDOM)),
                shown(record.figure(PATCH)),
                "; ".join(transfer),
            ])  # fmt: skip
    return lines


def knowledge_rows(table: Table) -> list[list[str]]:
    """The cells of the table of attacks by knowledge: the worst value of each row of `table` under each kind
    of attack.
    """
    lines = []
    for row in table.rows:
        record = row.first.record
        cells = []
        for knowledge in ("white-box", "black-box"):
            found = [
                figure
                for filed in (*row.own, *row.attacks)
                if filed.record.attack.knowledge == knowledge
                for kind in filed.record.kinds()
                if kind not in (NONE, RANDOM)
                and (filed in row.own or not is_transfer(kind))
                and (figure := filed.record.figure(kind)) is not None
            ]
            sign = -1.0 if table.lower_is_better else 1.0
            cells.append(shown(min(found, key=lambda one: sign * (one.value or 0.0), default=None)))
        lines.append([named(record.entry.network), named(record.entry.defense), *cells])
    return lines


def _effort(record: Record) -> str:
    return f"{record.attack.queries} queries" if record.attack.queries else f"{record.attack.steps} steps"


def board_json(tables: Sequence[Table], refused: Sequence[str]) -> Json:
    """Returns the content of board.json: the lines `refused`, and the `tables` with their rows.

    Args:
        tables: one table per benchmark, task and metric.
        refused: one line for each file that is no valid record.
    """
    return {
        "format": "gear-leaderboard",
        "version": 1,
        "refused": list(refused),
        "tables": [
            {
                "benchmark": table.benchmark,
                "data_key": table.data_key,
                "task": table.task,
                "metric": table.metric,
                "lower_is_better": table.lower_is_better,
                "rows": [_row_json(row) for row in table.rows],
            }
            for table in tables
        ],
    }


def _row_json(row: Row) -> Json:
    record = row.first.record
    return {
        "network": named(record.entry.network),
        "defense": named(record.entry.defense),
        "state": row.state,
        "is_ranked": row.is_ranked,
        "worst": None if row.worst is None else to_json(row.worst[0]) | {"record": row.worst[1].sha256},
        "results": [to_json(one) for one in record.results if one.name == record.entry.metric],
        "faults": list(row.faults),
        "warnings": list(row.warnings),
        "records": [one.sha256 for one in row.own],
        "attacks": [one.sha256 for one in row.attacks],
        "waiting": [one.sha256 for one in row.waiting],
    }
