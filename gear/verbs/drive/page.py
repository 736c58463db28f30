"""The report of a study in the closed loop as one self-contained HTML page."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from urllib.parse import quote

from gear.reporting.report_page import report_page
from gear.verbs.drive.metric_against_outcome import scatter
from gear.verbs.drive.report import DriveReport
from gear.verbs.drive.table import DEFINITIONS, cells, foretold, paired_cells, speed_cells


def page(report: DriveReport, figures: Sequence[tuple[str, bytes]] = (), videos: Sequence[tuple[str, str]] = ()) -> str:
    """The whole page as HTML text. Names from configs are escaped, and the page has no scripts.

    Args:
        report: the report.
        figures: SVG charts of situations, each with its title.
        videos: paths of the videos of twins, relative to the folder of the page, each with its title.
    """
    parts = ["<h2>Drivers, scenarios and twins</h2>", table(cells(report), 3)]
    parts += ["<h2>By speed</h2>", table(speed_cells(report), 2)]
    paired = paired_cells(report)
    if len(paired) > 1:
        parts += ["<h2>Against the other twins of the same situations</h2>", table(paired, 4)]
    if report.losses():
        lines = "<br>".join(html.escape(line) for line in foretold(report))
        drawn = scatter([one for losses in report.losses().values() for one in losses])
        parts += [f"<h2>Does the metric of single pictures predict crashes?</h2><p>{lines}</p>"]
        parts.append(f'<p><img alt="metric lost against least time to collision" src="{_source(drawn)}"></p>')
    means = "".join(f"<p><b>{html.escape(title)}</b>: {html.escape(what)}.</p>" for title, what in DEFINITIONS.items())
    parts.append(f"<h2>What the columns mean</h2>{means}")
    if figures:
        parts.append("<h2>Situations from above</h2>")
    for title, drawn in figures:
        name = html.escape(title, quote=True)
        parts.append(f'<h3>{name}</h3><p><img alt="ways and speeds: {name}" src="{_source(drawn)}"></p>')
    if videos:
        links = "".join(f'<li><a href="{quote(path)}">{html.escape(title)}</a></li>' for title, path in videos)
        parts.append(f"<h2>Videos of the twins beside each other</h2><ul>{links}</ul>")
    if report.failed:
        failed = "".join(f"<li>{html.escape(title)}: {html.escape(problem)}</li>" for title, problem in report.failed)
        parts.append(f"<h2>Drives that could not be made</h2><ul>{failed}</ul>")
    return report_page("gear drive", parts)


def _source(drawn: bytes) -> str:
    """An SVG as the source of an embedded picture."""
    return f"data:image/svg+xml;base64,{base64.b64encode(drawn).decode()}"


def table(rows: Sequence[Sequence[str]], named: int) -> str:
    """Returns a table as HTML. Cells of the first `named` - 1 columns that repeat the row above are left empty.

    Args:
        rows: the titles, and the cells of each row.
        named: number of columns that name the row, such as driver and twin.
    """
    head, *body = rows
    top = "".join(f"<th>{html.escape(cell)}</th>" for cell in head)
    lines, before = [], [""] * named
    for row in body:
        kept = next((i for i in range(named) if row[i] != before[i]), named)
        shown = ["" if i < min(kept, named - 1) else cell for i, cell in enumerate(row)]
        marked = " class=first" * (kept < named - 1)
        lines.append(f"<tr{marked}>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in shown) + "</tr>")
        before = list(row[:named])
    inner = "\n".join(lines)
    return f'<div class="wide"><table><thead><tr>{top}</tr></thead><tbody>\n{inner}\n</tbody></table></div>'
