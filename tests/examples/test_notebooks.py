"""The notebooks as files; the documents' build runs them (tests/docs/test_pages.py)."""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "examples/notebooks").glob("*.ipynb"))


def cells(path: Path, kind: str) -> list[dict[str, Any]]:
    return [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == kind]


def test_the_way_to_a_patch_and_its_twin_has_ten_cells() -> None:
    (path,) = (path for path in NOTEBOOKS if path.stem == "patch_and_twin")
    assert len(cells(path, "code")) == 10


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_are_stored_without_outputs(path: Path) -> None:
    for cell in cells(path, "code"):
        assert cell["outputs"] == [] and cell["execution_count"] is None
        ast.parse("".join(cell["source"]))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_the_site_shows_every_notebook(path: Path) -> None:
    assert f"../reference/generated/{path.stem}\n" in (ROOT / "docs/tutorials/index.md").read_text()
