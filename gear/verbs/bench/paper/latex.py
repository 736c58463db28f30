"""The tables of a benchmark as LaTeX: one file per table, and a document that shows them all."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from gear.verbs.bench.paper.tables import Cell, PaperTable

COLOURS = {"worse": "B00000", "better": "00B000", "same": "0000B0"}
"""The paper's text colours."""

GREY = r"\cellcolor[HTML]{E4E4E4}"

SPECIAL = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{", "}": r"\}",
    "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}", ">": r"\textgreater{}",
}  # fmt: skip

PACKAGES = ("booktabs", "graphicx")
"""Packages of the document besides geometry and xcolor; all are in the smallest installations of TeX Live."""


NARROWED = r"\ifdim\width>\textwidth\textwidth\else\width\fi"
"""Width of a table in the document: its own, or that of the text if the table is wider."""


def safe(text: str) -> str:
    """Returns a text in which LaTeX reads no character as a command; characters beyond ASCII become `?`."""
    return "".join(SPECIAL.get(mark, mark if mark.isascii() and mark.isprintable() else "?") for mark in text)


def tabular(table: PaperTable) -> str:
    """Returns a table as a LaTeX `tabular` with rules of the package booktabs; colours need xcolor with `table`."""
    groups = "".join(rf" & \multicolumn{{{count}}}{{c}}{{{safe(task)}}}" for task, count in table.tasks)
    rules, begin = [], 3
    for _, count in table.tasks:
        rules.append(rf"\cmidrule(lr){{{begin}-{begin + count - 1}}}")
        begin += count
    lines = [
        rf"\begin{{tabular}}{{ll{'r' * len(table.columns)}}}",
        r"\toprule",
        rf" & {groups} \\",
        "".join(rules),
        f" & & {' & '.join(safe(title) for title in table.columns)} \\\\",
    ]
    for scene, grouped in groupby(table.lines, key=lambda line: line.scene):
        members = list(grouped)
        lines.append(r"\midrule")
        for number, line in enumerate(members):
            head = f"{{{safe(scene)}}}" if number == 0 else ""  # rules read a `[` that follows as an option
            cells = " & ".join(_cell(cell) for cell in line.cells)
            lines.append(rf"{head} & {safe(line.label)} & {cells} \\")
    return "\n".join([*lines, r"\bottomrule", r"\end{tabular}"]) + "\n"


def document(tables: Sequence[PaperTable], title: str) -> str:
    """Returns a LaTeX document that inputs the files of all tables; a table that is wider than the text is scaled to
    its width.

    Args:
        tables: the tables; the file of each is in the folder of the document.
        title: title of the document.
    """
    lines = [
        r"\documentclass[10pt]{article}",
        r"\usepackage[a4paper,margin=1.5cm]{geometry}",
        r"\usepackage[table]{xcolor}",
        *(rf"\usepackage{{{name}}}" for name in PACKAGES),
        r"\begin{document}",
        rf"\section*{{{safe(title)}}}",
    ]
    for table in tables:
        lines += [
            r"\begin{table}[ht]",
            r"\centering",
            rf"\caption{{{safe(table.caption)}}}",
            rf"\resizebox{{{NARROWED}}}{{!}}{{\input{{{table.name}}}}}",
            r"\end{table}",
            r"\clearpage",
        ]
    return "\n".join([*lines, r"\end{document}"]) + "\n"


def _cell(cell: Cell) -> str:
    text = safe(cell.text)
    if text.startswith(("+", "-")):
        text = f"${text}$"
    if cell.tone == "reference":
        text = rf"\textbf{{{text}}}"
    elif cell.tone:
        text = rf"\textcolor[HTML]{{{COLOURS[cell.tone]}}}{{{text}}}"
    return f"{GREY}{text}" if cell.is_grey else text
