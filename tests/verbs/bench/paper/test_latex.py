"""LaTeX of the tables: its structure, and that it compiles where LaTeX is installed."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from gear.verbs.bench.paper.latex import document, safe, tabular
from gear.verbs.bench.paper.tables import paper_tables
from tests.verbs.bench.synthetic import report


def test_every_line_has_all_columns() -> None:
    for table in paper_tables(report()):
        text = tabular(table)
        wanted = 1 + len(table.columns)
        body = [line for line in text.splitlines() if line.endswith(r"\\") and "multicolumn" not in line]
        assert len(body) == 1 + len(table.lines)
        assert all(len(re.findall(r"(?<!\\)&", line)) == wanted for line in body)
        assert text.count("{") == text.count("}") and text.count(r"\begin") == text.count(r"\end")
        for rule in (r"\toprule", r"\bottomrule", r"\midrule", r"\cmidrule(lr){3-"):
            assert rule in text


def test_texts_of_users_are_no_commands() -> None:
    assert safe(r"a_b & {\x} ü") == r"a\_b \& \{\textbackslash{}x\} ?"
    assert r"clean\&er" in tabular(paper_tables(report())[1])


def test_the_document_inputs_every_table_and_compiles(tmp_path: Path) -> None:
    tables = paper_tables(report())
    text = document(tables, "gear bench a_b")
    assert re.findall(r"\\input\{(.*?)\}", text) == [table.name for table in tables]
    assert re.findall(r"\\usepackage(?:\[.*?\])?\{(.*?)\}", text) == [
        "geometry", "xcolor", "booktabs", "graphicx",
    ]  # fmt: skip
    if shutil.which("pdflatex") is None:
        pytest.skip("there is no pdflatex")
    (tmp_path / "tables.tex").write_text(text)
    for table in tables:
        odd = tuple(replace(line, scene=line.scene.replace("town10-truck", "[2pt] *{&^~#")) for line in table.lines)
        (tmp_path / f"{table.name}.tex").write_text(tabular(replace(table, lines=odd)))
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "tables.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
