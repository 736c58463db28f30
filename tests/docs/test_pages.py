"""The documents as a whole: folders of examples, the pages for plugin authors, the strict build of the site."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.blocks import DOCS, ROOT, pages


def test_there_is_a_page_for_every_kind_of_plugin() -> None:
    found = [path.stem for path in sorted((DOCS / "how-to").glob("write-a*.md"))]
    kinds = ["controller", "defense", "logger", "metric", "model", "task"]
    assert found == [*(f"write-a-{kind}" for kind in kinds), "write-an-attack"]


def test_a_folder_holds_the_dataset_of_one_task_on_every_page() -> None:
    """A reader who follows two pages would otherwise be refused: the folder holds the dataset of another task."""
    tasks: dict[str, set[str]] = {}
    for page in pages():
        text = page.read_text().replace("\\\n", " ")
        for task, folder in re.findall(r"gear collect --task (\w+)[^\n]*? --out (\S+)", text):
            tasks.setdefault(folder, set()).add(task)
    assert len(tasks) > 8
    assert {folder: sorted(of) for folder, of in tasks.items() if len(of) > 1} == {}


@pytest.mark.parametrize("page", [page for page in pages() if DOCS not in page.parents], ids=str)
def test_links_of_pages_outside_the_site_lead_somewhere(page: Path) -> None:
    targets = re.findall(r"\]\((?!https?:|#)([^)#\s]+)", page.read_text())
    assert [target for target in targets if not (page.parent / target).exists()] == []


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    """No dead link, no undocumented public name: what `./run docs` does."""
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-n", "-q", "-b", "html", str(DOCS), str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


RESULTS = [page for page in pages() if page.parent.name == "results" and page.stem != "index"]
LINES = ("Date", "Commit", "Machine", "Command", "Inputs", "State")


@pytest.mark.parametrize("page", RESULTS, ids=lambda page: page.stem)
def test_every_section_of_results_says_where_its_figures_come_from(page: Path) -> None:
    sections = re.split(r"^## ", page.read_text(), flags=re.MULTILINE)[1:]
    assert sections
    for section in sections:
        heading, *lines = section.splitlines()
        found = [re.match(r"- \*\*(\w+):\*\* \S", line) for line in lines[1:7]]
        assert [match and match[1] for match in found] == list(LINES), heading
        assert re.search(r"\d{4}-\d{2}-\d{2}", lines[1]) and re.search(r"\b[0-9a-f]{8}\b", lines[2]), heading


def test_commits_of_results_are_in_the_history() -> None:
    shallow = subprocess.run(
        ["git", "rev-parse", "--is-shallow-repository"], cwd=ROOT, capture_output=True, text=True, check=False
    ).stdout.strip()
    if shallow != "false":
        pytest.skip("the whole history is not here")
    named = {
        commit
        for page in RESULTS
        for line in re.findall(r"- \*\*Commit:\*\* (.*)", page.read_text())
        for commit in re.findall(r"\b[0-9a-f]{8}\b", line)
    }
    asked = "".join(f"{commit}\n" for commit in sorted(named))
    answer = subprocess.run(
        ["git", "cat-file", "--batch-check"], cwd=ROOT, input=asked, capture_output=True, text=True, check=True
    ).stdout
    assert [line for line in answer.splitlines() if " commit " not in line] == []


def test_every_section_of_results_says_whether_it_is_current() -> None:
    made = runpy.run_path(str(DOCS / "stale_results.py"))
    for page in RESULTS:
        assert page.read_text(encoding="utf-8") == made["marked"](page), "run: python docs/stale_results.py"
    assert made["INDEX"].read_text(encoding="utf-8") == made["index"](), "run: python docs/stale_results.py"


def test_the_comparison_with_the_paper_is_that_of_its_numbers() -> None:
    made = runpy.run_path(str(DOCS / "paper_comparison.py"))
    assert made["PAGE"].read_text(encoding="utf-8") == made["page"](), "run: python docs/paper_comparison.py"


def test_several_tests_are_corrected_as_by_holm() -> None:
    holm = runpy.run_path(str(DOCS / "paper_comparison.py"))["holm"]
    # The smallest p times 4, the next times 3, and so on; never less than the one before.
    assert holm({"a": 0.03, "b": 0.01, "c": None, "d": 0.04, "e": 0.005}) == pytest.approx(
        {"a": 0.06, "b": 0.03, "c": None, "d": 0.06, "e": 0.02}
    )


def test_figures_are_stale_when_a_file_that_they_depend_on_changes(tmp_path: Path) -> None:
    digest = runpy.run_path(str(DOCS / "stale_results.py"))["digest"]
    (tmp_path / "town").mkdir()
    (tmp_path / "town" / "a.xml").write_text("one")
    first = digest(tmp_path)
    (tmp_path / "town" / "a.xml").write_text("two")
    second = digest(tmp_path)
    (tmp_path / "town" / "a.xml").rename(tmp_path / "town" / "b.xml")
    assert len({first, second, digest(tmp_path)}) == 3
    (tmp_path / "town" / "b.xml").rename(tmp_path / "town" / "a.xml")
    (tmp_path / "town" / "a.xml").write_text("one")
    (tmp_path / "dynamics").mkdir()
    (tmp_path / "dynamics" / "car.xml").write_text("no picture shows it")
    (tmp_path / "town" / "a.xml").write_text('one\n<numeric name="key_point.nose" data="0 0 1.6"/>')
    assert digest(tmp_path) == first


def test_the_map_of_rooms_is_what_the_code_is() -> None:
    made = runpy.run_path(str(DOCS / "make_map.py"))
    hint = "run: python docs/make_map.py"
    assert made["PICTURE"].read_text(encoding="utf-8") == made["picture"](), hint
    assert made["PAGE"].read_text(encoding="utf-8") == made["page"](), hint


@pytest.mark.parametrize("page", pages(), ids=lambda page: str(page.relative_to(ROOT)))
def test_files_that_a_page_names_exist(page: Path) -> None:
    """Paths of this repository, such as `gear/values/scene.py`, without those that have a placeholder in brackets."""
    tops = "gear|tests|docs|mjcf|configs|authoring|benchmarks|examples|weights"
    named = re.findall(rf"`((?:{tops})/[\w./-]+?)/?`", page.read_text())
    assert [path for path in named if not (ROOT / path).exists()] == []
