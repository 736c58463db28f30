"""Plain-text tables that fit the width of a terminal."""

from __future__ import annotations

import io
from collections.abc import Sequence

WIDTH = 100
"""Default width of a table in characters."""

GAP = 2
"""Number of spaces between two columns."""

SHORTEST = 20
"""Smallest width of a list's last column, in characters."""


def text_table(
    head: Sequence[str], rows: Sequence[Sequence[str]], *, width: int = WIDTH, wrap: bool = False
) -> list[str]:
    """Formats a list with a description in the last column as a table.

    Args:
        head: titles of the columns.
        rows: cells of each row, one per column. The last column takes the remaining width.
        width: largest number of characters per line, unless the last column would be narrower than `SHORTEST`.
        wrap: whether long descriptions continue on the next line; otherwise they are cut.

    Returns:
        Lines without trailing spaces.
    """
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, padding=(0, GAP, 0, 0), header_style="", expand=False)
    widths = [max(len(row[i]) for row in (head, *rows)) for i in range(len(head) - 1)]
    widths.append(max(width - sum(widths) - GAP * len(head), SHORTEST))
    for title, column_width in zip(head, widths, strict=True):
        table.add_column(title, width=column_width, no_wrap=not wrap, overflow="fold" if wrap else "ellipsis")
    for row in rows:
        table.add_row(*row)
    out = io.StringIO()
    # Rich would cut the names, not the descriptions, to fit a line that is too short for both.
    wide = max(width, sum(widths) + GAP * len(head))
    Console(file=out, width=wide, color_system=None, markup=False, highlight=False, emoji=False).print(table)
    return [line.rstrip() for line in out.getvalue().splitlines()]


def number_table(cells: Sequence[Sequence[str]], *, width: int = WIDTH) -> list[str]:
    """Formats a table of numbers without wrapping cells; columns that do not fit the width follow in further
    blocks.

    Args:
        cells: the titles and the rows, all of one length. The first column names the row and is repeated in each block.
        width: largest number of characters per line; a single column may be wider.

    Returns:
        Lines without trailing spaces; blocks are separated by an empty line.
    """
    widths = [max(len(row[i]) for row in cells) for i in range(len(cells[0]))]
    blocks: list[list[int]] = [[0]]
    for i in range(1, len(widths)):
        used = sum(widths[k] + GAP for k in blocks[-1])
        if len(blocks[-1]) > 1 and used + widths[i] > width:
            blocks.append([0])
        blocks[-1].append(i)
    lines: list[str] = []
    for block in blocks:
        lines += [""] * bool(lines)
        rows = [row for row in cells if row is cells[0] or len(blocks) == 1 or any(row[i] for i in block[1:])]
        lines += [(" " * GAP).join(row[i].ljust(widths[i]) for i in block).rstrip() for row in rows]
    return lines
