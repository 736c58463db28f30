"""The documents as a whole: folders of examples, the pages for plugin authors, the strict build of the site."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.blocks import DOCS, ROOT, pages


def test_there_is_a_page_for_every_kind_of_plugin() -> None:
    found = [path.stem for path in sorted((DOCS / "how-to").glob("write-a*.md"))]
    assert found == ["write-a-defense", "write-a-model", "write-a-task", "write-an-attack"]


def test_a_folder_holds_the_dataset_of_one_task_on_every_page() -> None:
    """A reader who follows two pages would otherwise be refused: the folder holds the dataset of another task."""
    tasks: dict[str, set[str]] = {}
    for page in pages():
        text = page.read_text().replace("\\\n", " ")
        for task, folder in re.findall(r"gear collect --task (\w+)[^\n]*? --out (\S+)", text):
            tasks.setdefault(folder, set()).add(task)
    assert len(tasks) > 8
    assert {folder: sorted(of) for folder, of in tasks.items() if len(of) > 1} == {}


@pytest.mark.parametrize("page", [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "authoring/README.md"], ids=str)
def test_links_of_pages_outside_the_site_lead_somewhere(page: Path) -> None:
    targets = re.findall(r"\]\((?!https?:|#)([^)#\s]+)", page.read_text())
    assert [target for target in targets if not (page.parent / target).exists()] == []


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    """No dead link, no undocumented public name: what `./run docs` does."""
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-n", "-q", "-b", "html", str(DOCS), str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
