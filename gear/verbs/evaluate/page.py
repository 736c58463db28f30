"""The results of an evaluation as an HTML page: the table, with links to pictures of what changed most."""

from __future__ import annotations

from urllib.parse import quote

from gear.reporting.html_table import Cell, Link, html_table, safe
from gear.reporting.report_page import NEARBY, report_page
from gear.verbs.evaluate.report import EvaluateReport
from gear.verbs.evaluate.table import few_streets_note, row_labels, table_cells, title

PAGE = "report.html"
"""Name of the page in the folder of the evaluation."""


def page(report: EvaluateReport) -> str:
    """Returns the page of an evaluation as HTML text; its pictures are files next to the page.

    Args:
        report: results of the evaluation.
    """
    labels = row_labels(report.rows)
    sheets = {row.name: row.pictures for row in report.rows if row.pictures is not None}
    head, *lines = table_cells(report)
    rows: list[tuple[bool, list[Cell]]] = []
    for name, cells in lines:
        first: Cell = Link(cells[0], f"#{quote(name)}") if name in sheets else cells[0]
        rows.append((name is not None, [first, *cells[1:]]))
    parts = [html_table(head[1], rows)]
    few = few_streets_note(text for _, cells in lines for text in cells)
    parts += [f'<p class="dim">Note: {safe(note)}</p>' for note in [*few, *report.facts.get("notes", [])]]
    for row in report.rows:
        if row.name in sheets:
            source, caption = quote(sheets[row.name]), f"{labels[row.name]}, patch {row.patch}"
            parts += [
                f'<h2 id="{quote(row.name)}">{safe(caption)}</h2>',
                f'<a href="{source}"><img alt="{safe(f"samples of {caption} that changed most")}" loading="lazy"'
                f' src="{source}"></a>',
            ]
    return report_page(title(report), parts, sources=NEARBY)
