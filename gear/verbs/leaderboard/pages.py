"""The HTML pages of the leaderboard. Every text comes from strangers and is escaped; pages have no scripts and load
nothing.
"""

from __future__ import annotations

import html
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

from gear.driving.statistics import Rate
from gear.leaderboard.board import Row, Table
from gear.leaderboard.drive_claims import crashes
from gear.leaderboard.reading import Filed
from gear.leaderboard.record import Plugin, Record
from gear.leaderboard.verdict import Verdict
from gear.verbs.drive.table import rate
from gear.verbs.leaderboard.drive_page import HEAD as DRIVE_HEAD
from gear.verbs.leaderboard.drive_page import LEGEND as DRIVE_LEGEND
from gear.verbs.leaderboard.drive_page import DriveRow, DriveTable, drive_cells
from gear.verbs.leaderboard.texts import (
    ATTACKS,
    BY_KNOWLEDGE,
    HEAD,
    attack_rows,
    defense_cells,
    knowledge_rows,
    named,
    shown,
)

R = TypeVar("R", Row, DriveRow)

STYLE = """
body { font: 15px/1.5 system-ui, "Segoe UI", Roboto, "Noto Sans", sans-serif; color: #1b2027; background: #fff;
  max-width: 84rem; margin: 2rem auto; padding: 0 1.25rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin: 2.5rem 0 .5rem; } h3 { font-size: .95rem; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-size: .85rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .25rem .7rem; vertical-align: top; } th { border-bottom: 2px solid #1b2027; }
td { border-bottom: 1px solid #dde2e7; overflow-wrap: anywhere; } .dim { color: #5b6672; }
td.broken, td.differs { color: #a02020; font-weight: 600; } td.reproduced, td.same { color: #1d6b3a; font-weight: 600; }
@media print { body { max-width: none; margin: 0; } .wide { overflow: visible; } table { font-size: .6rem; } }
"""

LEGEND = (
    "Rows are ranked by the worst known figure under any optimised patch, by the author of the row or by others. In "
    "brackets: 95 % intervals. claimed: nobody has measured the row again; reproduced: a check computed the ranked "
    "metric again, directly or through its samples; broken: a check contradicts it, or a reproduced attack takes its "
    "gain away. No check computes the intervals and AUROC again. AUROC: how well the defense's score separates "
    "pictures with a patch from those with a random one."
)

START = '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>'
BACK = '<p><a href="../index.html">leaderboard</a></p>'
"""Link of a record's page to the main page."""


def drives_page(tables: Sequence[DriveTable]) -> str:
    """Returns the page about drives as HTML text: collision rates by network, defense and controller.

    Args:
        tables: tables of rows that drove through the same scenarios in the same scenes.
    """
    parts = ['<p><a href="index.html">leaderboard</a></p>', f'<p class="dim">{_safe(DRIVE_LEGEND)}</p>']
    for table in tables:
        ranked = _ranked(DRIVE_HEAD, table.rows, [one.row.first for one in table.rows], drive_cells)
        parts += [f"<h2>Benchmark {_safe(table.title)}</h2>", ranked]
    return _page("gear leaderboard: drives", parts if tables else [*parts, "<p>No record has drives.</p>"])


def index_page(tables: Sequence[Table], refused: Sequence[str], commitment: str | None) -> str:
    """Returns the main page of a leaderboard as HTML text: for each benchmark and task the defenses, the attacks, and
    the attacks by knowledge.

    Args:
        tables: one table per benchmark and task.
        refused: one line for each file that is no valid record.
        commitment: salted hash of the withheld scenes; None if there are none.
    """
    parts = [f'<p class="dim">{_safe(LEGEND)}</p>']
    if commitment is not None:
        parts.append(f'<p class="dim">Salted hash of the withheld scenes: {_safe(commitment)}</p>')
    if any(one.record.drives for table in tables for row in table.rows for one in row.own):
        parts.append('<p><a href="drives.html">Drives in the closed loop: collision rates</a></p>')
    for table in tables:
        better = "lower" if table.lower_is_better else "higher"
        title = f"{table.task}: {table.metric} ({better} is better), benchmark {table.benchmark} {table.data_key[:8]}"
        ranked = _ranked(HEAD, table.rows, [row.first for row in table.rows], defense_cells)
        parts += [f"<h2>{_safe(title)}</h2>", ranked, _notes(table)]
        parts += [_titled("Attacks", ATTACKS, attack_rows(table))]
        parts += [_titled("Worst figure by the attack's knowledge", BY_KNOWLEDGE, knowledge_rows(table))]
    if refused:
        parts.append("<h2>Refused files</h2>" + _list(refused))
    return _page("gear leaderboard", parts)


def record_page(filed: Filed, verdict: Verdict | None) -> str:
    """Returns the page of one record as HTML text: what it claims, and what the check found.

    Args:
        filed: the record with its file.
        verdict: result of the check; None if nobody has checked the record.
    """
    record = filed.record
    entry = record.entry
    facts = [
        ("record", filed.sha256),
        ("kind", entry.kind),
        ("task", entry.task),
        ("network", f"{named(entry.network)}, weights {entry.network.weights_sha256 or '-'}"),
        ("defense", named(entry.defense)),
        *([] if record.controller is None else [("controller of the drives", _with_wheel(record.controller))]),
        ("gradient of the defense", entry.gradient or "-"),
        ("is random", "yes" if entry.is_random else "no"),
        ("attack", f"{named(record.attack.plugin)}, {record.attack.knowledge}, {record.attack.steps} steps, "
                   f"{record.attack.queries} queries"),
        ("licence", entry.licence), ("authors", entry.authors), ("paper", entry.paper),
        ("trained on", entry.trained_on),
        ("benchmark", f"{record.benchmark.name}, seed {record.benchmark.seed}, {record.benchmark.sha256}"),
        *sorted(record.environment.items()),
    ]  # fmt: skip
    figures = [[one.patch, one.name, shown(one), str(one.n)] for one in record.results]
    data = [[one.scene, one.weather, one.patch, str(one.samples), one.content_key] for one in record.data]
    parts = [
        BACK,
        _table(("what", "value"), [list(fact) for fact in facts]),
        _titled("Results", ("patch", "figure", "value", "samples"), figures),
        _titled("Drives", ("patch", "collision rate", "drives"), _driven(record)),
        _titled("Data", ("scene", "weather", "patch", "samples", "content key"), data),
    ]
    if verdict is None:
        parts.append("<h3>Check</h3><p>Nobody has checked this record.</p>")
    else:
        parts.append(_titled(f"Check: {verdict.state}", ("", "finding"), [[o.level, o.text] for o in verdict.findings]))
    return _page(f"{named(entry.network)} {named(entry.defense)}", parts)


def _with_wheel(plugin: Plugin) -> str:
    return f"{named(plugin)}, wheel {plugin.wheel_sha256 or '-'}, code {plugin.code_sha256}"


def _driven(record: Record) -> list[list[str]]:
    """The collision rates of a record by kind of patch, for its page."""
    kinds = dict.fromkeys(one.patch for one in record.drives)
    rates = [(kind, Rate.of(crashes(record.drives, kind))) for kind in kinds]
    return [[kind, rate(value), str(value.total)] for kind, value in rates if value.total]


def is_record_page(data: bytes) -> bool:
    """Whether the content of a file is that of a page that `record_page` made."""
    return data.startswith(START.encode()) and BACK.encode() in data


def _ranked(
    head: Sequence[str], rows: Sequence[R], records: Sequence[Filed], cells_of: Callable[[R, int | None], list[str]]
) -> str:
    """Returns a table of rows with ranks; the network links to the page of a record, and the state has a colour.

    Args:
        head: titles of the columns, with `network` and `state`.
        rows: the rows, ranked ones first.
        records: the record of each row to which the row links.
        cells_of: makes the cells of a row from the row and its rank.
    """
    network, state = head.index("network"), head.index("state")
    lines, rank = [], 0
    for row, record in zip(rows, records, strict=True):
        rank += row.is_ranked
        texts = cells_of(row, rank if row.is_ranked else None)
        cells = [_cell(text) for text in texts]
        cells[network] = f'<td><a href="records/{record.sha256}.html">{_safe(texts[network])}</a></td>'
        cells[state] = f'<td class="{row.state}">{row.state}</td>'
        lines.append("".join(cells))
    return _rows(head, lines)


def _notes(table: Table) -> str:
    """Returns the faults and warnings of all rows as a list."""
    lines = [line for row in table.rows for line in _row_notes(row)]
    return _list(lines)


def _row_notes(row: Row) -> Iterable[str]:
    entry = row.first.record.entry
    pair = f"{named(entry.network)} with {named(entry.defense)}"
    yield from (f"{pair}: not ranked, because {line}" for line in row.faults)
    yield from (f"{pair}: flag: {line}" for line in row.warnings)
    if row.waiting:
        yield f"{pair}: {len(row.waiting)} attack(s) of others wait for a check"


def _titled(title: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return f"<h3>{_safe(title)}</h3>{_table(head, rows)}" if rows else ""


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return _rows(head, ["".join(_cell(cell) for cell in cells) for cells in rows])


def _rows(head: Sequence[str], rows: Sequence[str]) -> str:
    top = "".join(f"<th>{_safe(cell)}</th>" for cell in head)
    body = "\n".join(f"<tr>{cells}</tr>" for cells in rows)
    return f'<div class="wide"><table><thead><tr>{top}</tr></thead><tbody>\n{body}\n</tbody></table></div>'


def _cell(text: str) -> str:
    return f"<td>{_safe(text)}</td>"


def _list(lines: Sequence[str]) -> str:
    return f"<ul>{''.join(f'<li>{_safe(line)}</li>' for line in lines)}</ul>" if lines else ""


def _page(title: str, parts: Iterable[str]) -> str:
    policy = "default-src 'none'; style-src 'unsafe-inline'"
    return (
        f"{START}{_safe(title)}</title>\n"
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        f'<meta name="viewport" content="width=device-width"><style>{STYLE}</style></head>\n'
        f"<body><h1>{_safe(title)}</h1>\n" + "\n".join(part for part in parts if part) + "\n</body></html>\n"
    )


def _safe(text: str) -> str:
    return html.escape(text, quote=True)
