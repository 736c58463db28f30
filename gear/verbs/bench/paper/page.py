"""The paper's tables as HTML."""

from __future__ import annotations

from gear.reporting.html_table import safe
from gear.verbs.bench.paper.tables import PaperTable

TITLES = {
    "table1": "Table 1: detection of patches by scene",
    "table2": "Table 2: clean and adversarial performance by scene",
    "table2-adaptive": "Table 2 for adaptive patches",
    "drives": "Collision rates of the drives",
}
"""Titles of the paper's tables by their names."""


def paper_table(table: PaperTable) -> str:
    """Returns a table of the paper as HTML, in its layout and colours, with its caption."""
    groups = "".join(f'<th colspan="{count}">{safe(task)}</th>' for task, count in table.tasks)
    titles = "".join(f"<th>{safe(title)}</th>" for title in table.columns)
    lines, before = [], None
    for line in table.lines:
        cells = "".join(
            f'<td class="{" ".join(filter(None, (cell.tone, "grey" * cell.is_grey)))}">{safe(cell.text)}</td>'
            for cell in line.cells
        )
        first = line.scene != before
        scene = safe(line.scene) if first else ""
        lines.append(f"<tr{' class=first' * first}><td>{scene}</td><td>{safe(line.label)}</td>{cells}</tr>")
        before = line.scene
    head = f"<tr><th></th><th></th>{groups}</tr><tr><th>scene</th><th>defense</th>{titles}</tr>"
    body = "\n".join(lines)
    return (
        f'<h2>{safe(TITLES[table.name])}</h2><p class="dim">{safe(table.caption)}</p><div class="wide">'
        f"<table><thead>{head}</thead><tbody>\n{body}\n</tbody></table></div>"
    )
