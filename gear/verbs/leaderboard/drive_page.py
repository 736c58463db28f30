"""The page of a leaderboard about drives in the closed loop: collision rates by network, defense and controller."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from gear.driving.statistics import Rate
from gear.leaderboard.board import Row, State, Table
from gear.leaderboard.drive_claims import crashes
from gear.leaderboard.reading import Filed
from gear.leaderboard.record import Plugin, Record, digest
from gear.leaderboard.rules import ADAPTIVE, NONE, PATCH, RANDOM
from gear.values.serial import Json
from gear.verbs.drive.table import rate
from gear.verbs.leaderboard.texts import named

HEAD = ("rank", "network", "defense", "controller", "state", "clean", "random", "patch", "adaptive", "worst known")
"""Column titles of the table of drives."""

LEGEND = (
    "Share of drives that ended in a crash, over all scenes and scenarios that are not free roads, with the exact 95 % "
    "interval of Clopper and Pearson. Rows are ranked by the worst known collision rate under any optimised patch, by "
    "the author of the row or by others; fewer collisions are better. A defense without drives under adaptive patches "
    "has no rank, and neither has a row that the rules exclude from the other tables. Each record holds the hash of "
    "the log of every drive, and a check drives a part of them again. Rows of one table drove through the same "
    "scenarios in the same scenes."
)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DriveRow:
    """The drives of one row of the leaderboard with one controller.

    Attributes:
        row: the row.
        controller: the controller that drove.
        rates: collision rate over all own records, by kind of patch.
        worst: the highest collision rate under an optimised patch, in one record of the row or in a reproduced attack
            of others, with the kind of patch and the record; None without such drives.
    """

    row: Row
    controller: Plugin
    rates: dict[str, Rate]
    worst: tuple[Rate, str, Filed] | None

    @property
    def state(self) -> State:
        """The state of the row: a check of a record drives again, too."""
        return self.row.state

    @property
    def is_ranked(self) -> bool:
        """Whether the row has a rank: there are drives with every kind of patch, for a defense with adaptive patches
        too, no check contradicts it, and no rule excludes the row (`gear.leaderboard.rules.faults`), such as the one
        on the loss on clean pictures.
        """
        needed = {NONE, RANDOM, PATCH} | ({ADAPTIVE} if self.row.first.record.entry.defense is not None else set())
        is_allowed = not self.row.faults and self.state != "broken"
        return self.worst is not None and needed <= self.rates.keys() and is_allowed


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DriveTable:
    """Rows that drove through the same scenarios in the same scenes.

    Attributes:
        title: name of the benchmark, and the beginning of the hash of all that the drives have in common.
        rows: ranked rows, those with the fewest collisions first, followed by the other rows.
    """

    title: str
    rows: tuple[DriveRow, ...]


def drive_tables(tables: Iterable[Table]) -> list[DriveTable]:
    """The tables of drives of a leaderboard.

    Args:
        tables: tables of the leaderboard with the records of all rows.
    """
    groups: dict[tuple[str, str], list[DriveRow]] = {}
    for table in tables:
        for row in table.rows:
            for key, group in _grouped(row.own).items():
                name, controller = group[0].record.benchmark.name, group[0].record.controller
                assert controller is not None
                made = DriveRow(
                    row=row,
                    controller=controller,
                    rates=_rates([one.record for one in group]),
                    worst=_worst([*group, *_grouped(row.attacks).get(key, [])]),
                )
                groups.setdefault((name, key[0]), []).append(made)
    return [
        DriveTable(title=f"{name} {key[:8]}", rows=tuple(sorted(rows, key=_order)))
        for (name, key), rows in sorted(groups.items(), key=lambda item: item[0])
    ]


def _grouped(records: Iterable[Filed]) -> dict[tuple[str, str], list[Filed]]:
    """Records with drives by what their drives have in common, and by their controller."""
    groups: dict[tuple[str, str], list[Filed]] = {}
    for one in records:
        if one.record.drives and one.record.controller is not None:
            config = one.record.benchmark.config
            drives = config.get("drives")
            asked = {key: value for key, value in drives.items() if key != "controllers"} if drives else {}
            same = digest({"drives": asked} | {key: config.get(key) for key in ("places", "weathers")})
            groups.setdefault((same, digest(list(map(str, one.record.controller.identity)))), []).append(one)
    return groups


def _rates(records: Sequence[Record]) -> dict[str, Rate]:
    found = {}
    for kind in (NONE, RANDOM, PATCH, ADAPTIVE):
        ends = [end for one in records for end in crashes(one.drives, kind)]
        if ends:
            found[kind] = Rate.of(ends)
    return found


def _worst(records: Sequence[Filed]) -> tuple[Rate, str, Filed] | None:
    found = [
        (Rate.of(ends), kind, one)
        for one in records
        for kind in (PATCH, ADAPTIVE)
        if (ends := crashes(one.record.drives, kind))
    ]
    return max(found, key=lambda one: one[0].value, default=None)


def _order(one: DriveRow) -> tuple[bool, float, str]:
    return not one.is_ranked, 2.0 if one.worst is None else one.worst[0].value, one.row.first.sha256


def drive_cells(one: DriveRow, rank: int | None) -> list[str]:
    """The cells of one row of the table of drives.

    Args:
        one: the row.
        rank: position in the table, from 1; None for rows that are not ranked.
    """
    entry = one.row.first.record.entry
    worst = ""
    if one.worst is not None:
        value, kind, filed = one.worst
        by = "" if filed in one.row.own else ", by others"
        worst = f"{rate(value)} ({kind}{by})"
    return [
        "" if rank is None else str(rank),
        named(entry.network),
        named(entry.defense),
        named(one.controller),
        one.state,
        *(rate(one.rates[kind]) if kind in one.rates else "" for kind in (NONE, RANDOM, PATCH, ADAPTIVE)),
        worst,
    ]


def drives_json(tables: Sequence[DriveTable]) -> Json:
    """The tables of drives as JSON, for board.json: crashes and drives by kind of patch, and the worst known rate."""
    return [
        {
            "benchmark": table.title,
            "rows": [
                {
                    "network": named(one.row.first.record.entry.network),
                    "defense": named(one.row.first.record.entry.defense),
                    "controller": named(one.controller),
                    "controller_wheel_sha256": one.controller.wheel_sha256,
                    "state": one.state,
                    "is_ranked": one.is_ranked,
                    "collisions": {kind: [value.count, value.total] for kind, value in one.rates.items()},
                    "worst": None
                    if one.worst is None
                    else {
                        "patch": one.worst[1],
                        "crashes": one.worst[0].count,
                        "drives": one.worst[0].total,
                        "record": one.worst[2].sha256,
                    },
                }
                for one in table.rows
            ],
        }
        for table in tables
    ]
