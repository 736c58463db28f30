"""`gear new`: what it writes works as it is."""

from __future__ import annotations

import ast
import os
import re
import sys
import sysconfig
from pathlib import Path

import pytest

from gear.cli.main import main
from gear.contracts.specs import KINDS
from gear.values.errors import GearError, UnknownNameError
from gear.verbs.scaffold.write import new_package
from tests.shared import call, make_builder

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("kind", KINDS)
def test_a_package_is_whole(kind: str, tmp_path: Path) -> None:
    folder = new_package(kind, "my-thing", out=tmp_path)
    assert folder == tmp_path / f"gear-{kind}-my-thing"
    assert {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()} == {
        "pyproject.toml",
        "README.md",
        "LICENSE",
        ".gitignore",
        f"src/gear_{kind}_my_thing/__init__.py",
        f"src/gear_{kind}_my_thing/my_thing.py",
        f"src/gear_{kind}_my_thing/py.typed",
        "tests/test_my_thing.py",
    }
    assert [p.name for p in tmp_path.iterdir()] == [folder.name]
    assert not [p for p in folder.rglob("*") if p.is_file() and "{{" in p.read_text()]
    for path in folder.rglob("*.py"):
        compile(path.read_text(), str(path), "exec")


@pytest.mark.parametrize(
    ("kind", "use"),
    [("task", "gear collect --task my_thing"), ("model", "--model my_thing"), ("defense", "--defense my_thing"),
     ("attack", "gear attack --attack my_thing"), ("metric", "--report my_thing"),
     ("controller", "controller: my_thing"), ("logger", "--log-to my_thing")],
)  # fmt: skip
def test_its_readme_says_how_gear_uses_it(kind: str, use: str, tmp_path: Path) -> None:
    assert use in (new_package(kind, "my_thing", out=tmp_path) / "README.md").read_text()


@pytest.mark.parametrize("name", ["Bad", "9lives", "a b", "", "a__b", "a_", "../up", "x" * 41, "class", "random", "é"])
def test_bad_names_get_one_line_and_no_files(name: str, tmp_path: Path) -> None:
    with pytest.raises(GearError) as caught:
        new_package("defense", name, out=tmp_path)
    assert "\n" not in str(caught.value) and repr(name) in str(caught.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["spec", "build", "hookimpl", "gear_defenses"])
def test_reserved_names_of_the_package_are_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(GearError, match=f"'{name}' is a word of every plugin package's; choose another, such as my_"):
        new_package("defense", name, out=tmp_path)


def test_a_plugin_that_is_there_is_not_written_again(tmp_path: Path) -> None:
    with pytest.raises(GearError, match="there is a task named 'semseg' already; choose another name, such as my_"):
        new_package("task", "semseg", out=tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert new_package("defense", "semseg", out=tmp_path).is_dir()


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        ("attack", "patch"),
        ("task", "rig"),
        ("task", "encoded"),
        ("defense", "defense_result"),
        ("model", "tensor"),
        ("metric", "evaluator"),
        ("controller", "action"),
        ("logger", "run"),
    ],
)
def test_its_classes_take_no_name_that_it_uses(kind: str, name: str, tmp_path: Path) -> None:
    for path in new_package(kind, name, out=tmp_path).rglob("*.py"):
        nodes = list(ast.walk(ast.parse(path.read_text())))
        classes = {node.name for node in nodes if isinstance(node, ast.ClassDef)}
        imported = {alias.name for node in nodes if isinstance(node, ast.ImportFrom) for alias in node.names}
        assert not classes & imported


def test_a_class_says_its_kind_once(tmp_path: Path) -> None:
    text = (new_package("attack", "my_attack", out=tmp_path) / "src/gear_attack_my_attack/my_attack.py").read_text()
    assert "class MyAttack:" in text and "import MyConfig" in text


def test_a_folder_that_is_there_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kept = tmp_path / "gear-task-lanes"
    kept.mkdir()
    assert main(["new", "task", "lanes", "--out", str(tmp_path)]) == 2
    assert "is there already" in capsys.readouterr().err
    assert list(kept.iterdir()) == []
    assert [p.name for p in tmp_path.iterdir()] == [kept.name]


def test_a_kind_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="did you mean defense"):
        new_package("defence", "my_blur", out=tmp_path)


def test_out_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(GearError, match="a file is where a folder should be"):
        new_package("defense", "my_blur", out=tmp_path / "file")


BLOCK = re.compile(r"```(?:sh)?(?: run)?\n(.*?)```", re.DOTALL)


def instructions(text: str) -> str:
    """The first code block of a page that installs a package."""
    return next(block for block in BLOCK.findall(text) if "pip install" in block)


PAGES = {
    "defense": "tutorials/defense-package.md",
    "task": "how-to/write-a-task.md",
    "model": "how-to/write-a-model.md",
    "attack": "how-to/write-an-attack.md",
    "metric": "how-to/write-a-metric.md",
    "controller": "how-to/write-a-controller.md",
    "logger": "how-to/write-a-logger.md",
}


@pytest.mark.parametrize("kind", KINDS)
def test_instructions_agree_wherever_they_stand(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", kind, "my_thing", "--out", str(tmp_path)]) == 0
    printed = [line.strip() for line in capsys.readouterr().out.splitlines()[1:]]
    steps = ["python -m pip install -e '.[dev]'", "python -m pytest"]
    assert printed[1:] == steps and printed[0].startswith("cd ")
    examples = [path.read_text() for path in sorted((ROOT / "examples").glob("gear-*/README.md"))]
    pages = [(ROOT / "docs" / PAGES[kind]).read_text(), (tmp_path / f"gear-{kind}-my-thing/README.md").read_text()]
    for text in (*pages, *(text for text in examples if "pip install" in text)):
        lines = [line for block in BLOCK.findall(text) for line in block.splitlines()]
        assert [line for line in lines if "pip install" in line or "-m pytest" in line] == steps


@pytest.fixture(scope="session")
def environment(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fresh environment that has gear, everything that the tests' own environment has, and what builds packages."""
    folder = tmp_path_factory.mktemp("fresh") / "env"
    make_builder(folder)
    (folder / "bin/gear").write_text(f'#!/bin/sh\nexec {folder}/bin/python -m gear.cli.main "$@"\n')
    (folder / "bin/gear").chmod(0o755)
    (folder / "bin/ruff").symlink_to(Path(sysconfig.get_path("scripts")) / "ruff")
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_its_readme_works_as_printed(kind: str, tmp_path: Path, mypy_cache: Path, environment: Path) -> None:
    folder = new_package(kind, "my_thing", out=tmp_path)
    env = os.environ | {
        "PATH": f"{environment}/bin:{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "PIP_CONSTRAINT": str(ROOT / "constraints.txt"),
        "MYPY_CACHE_DIR": str(mypy_cache),
        "XDG_CACHE_HOME": str(tmp_path / "cache"),
    }
    env.pop("VIRTUAL_ENV", None)
    if kind != KINDS[0]:  # one of them builds in an environment of its own; their [build-system] is the same template
        env["PIP_NO_BUILD_ISOLATION"] = "0"
    said = call("sh", "-eu", "-c", instructions((folder / "README.md").read_text()), cwd=folder, env=env)
    assert f"{kind} my_thing (gear-{kind}-my-thing 0.1.0)" in said and " passed" in said
    call("gear", "plugins", "--strict-plugins", cwd=tmp_path, env=env)
    call(sys.executable, "-m", "ruff", "format", "--check", ".", cwd=folder)
    call("python", "-m", "mypy", "tests", cwd=folder, env=env)
    call("python", "-m", "pip", "uninstall", "-q", "-y", folder.name, cwd=tmp_path, env=env)
