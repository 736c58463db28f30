"""The pages for plugin authors: their code runs, and the reference is what the code says."""

from __future__ import annotations

import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from gear.verbs.collect.run import collect

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted(DOCS.glob("write-a*.md"))
TINY = Path(__file__).parents[2] / "gear/testing/data"


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)


def test_there_is_a_page_for_every_kind() -> None:
    assert [p.stem for p in PAGES] == ["write-a-defense", "write-a-model", "write-a-task", "write-an-attack"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_python_of_a_page_runs_and_its_tests_pass(page: Path, tmp_path: Path) -> None:
    module = tmp_path / "test_page.py"
    module.write_text("\n".join(blocks(page, "python")) + "\n\ndef test_the_page_itself() -> None:\n    pass\n")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", str(tmp_path), str(module)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_python_of_the_page_on_evaluating_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    size = ["options.width_px=128", "options.height_px=64", f"scenes={TINY / 'scenes/tiny.yml'}"]
    collect(
        "semseg", town=TINY / "mjcf/towns/tiny.xml", scene="board", split="debug", samples=3, renderer="classic",
        quality="fast", out=tmp_path / "data", settings=size,
    )  # fmt: skip
    monkeypatch.chdir(tmp_path)
    (code,) = blocks(DOCS / "evaluate.md", "python")
    module = tmp_path / "page.py"
    module.write_text(code)
    assert runpy.run_path(str(module))["batch"].indices


def test_a_folder_is_of_one_task_on_whatever_page_it_is_collected() -> None:
    """Who follows the README and then a page would be told that the folder holds another task's dataset."""
    tasks: dict[str, set[str]] = {}
    for page in (DOCS.parent / "README.md", *sorted(DOCS.glob("*.md"))):
        text = page.read_text().replace("\\\n", " ")
        for task, folder in re.findall(r"gear collect --task (\w+)[^\n]*? --out (\S+)", text):
            tasks.setdefault(folder, set()).add(task)
    assert len(tasks) > 8
    assert {folder: sorted(of) for folder, of in tasks.items() if len(of) > 1} == {}


def test_the_contract_of_a_town_that_the_page_on_mjcf_shows_can_be_subclassed_as_shown(tmp_path: Path) -> None:
    (code,) = blocks(DOCS / "mjcf-conventions.md", "python")
    module = tmp_path / "test_mine.py"
    module.write_text(code)
    contract = runpy.run_path(str(module))["TestMyTown"]
    assert (contract.town, contract.scenes) == ("path/to/towns/mytown.xml", "path/to/mytown.yml")


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_shell_of_a_page_runs(page: Path, tmp_path: Path) -> None:
    """In a folder of its own; packages are installed beside the environment, not into it."""
    tools, site = tmp_path / "bin", tmp_path / "site"
    tools.mkdir()
    for name, module in (("gear", "gear.cli.main"), ("pip", "pip"), ("pytest", "pytest")):
        words = f'-m {module} "$@"' if name != "pip" else f'-m pip "$1" -q --target {site} --no-deps .'
        (tools / name).write_text(f"#!/bin/sh\nexec {sys.executable} {words}\n")
        (tools / name).chmod(0o755)
    env = os.environ | {"PATH": f"{tools}:{os.environ['PATH']}", "PYTHONPATH": str(site)}
    for script in blocks(page, "sh"):
        done = subprocess.run(["sh", "-eu", "-c", script], cwd=tmp_path, env=env, capture_output=True, text=True,
                              check=False)  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr


def test_the_reference_is_what_the_code_says() -> None:
    made = runpy.run_path(str(DOCS / "make_reference.py"))
    assert made["PAGE"].read_text() == made["page"](), "run: python docs/make_reference.py"
