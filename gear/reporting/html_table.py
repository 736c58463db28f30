"""Tables of HTML reports, whose cells may be links."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Link:
    """A cell of a table that is a link.

    Attributes:
        text: text of the cell.
        href: URL relative to the page.
    """

    text: str
    href: str


Cell = str | Link


def html_table(titles: Sequence[str], rows: Iterable[tuple[bool, Sequence[Cell]]]) -> str:
    """Returns an HTML table; all texts are escaped.

    Args:
        titles: titles of the columns.
        rows: for each row, whether a line is drawn above it, and its cells.
    """
    top = "".join(f"<th>{safe(cell)}</th>" for cell in titles)
    body = "\n".join(
        f"<tr{' class=first' * is_first}>" + "".join(f"<td>{_cell(cell)}</td>" for cell in cells) + "</tr>"
        for is_first, cells in rows
    )
    return f'<div class="wide"><table><thead><tr>{top}</tr></thead><tbody>\n{body}\n</tbody></table></div>'


def safe(text: str) -> str:
    """Returns a text escaped for HTML, also inside attributes.

    Args:
        text: any text.
    """
    return html.escape(text, quote=True)


def _cell(cell: Cell) -> str:
    return safe(cell) if isinstance(cell, str) else f'<a href="{safe(cell.href)}">{safe(cell.text)}</a>'
