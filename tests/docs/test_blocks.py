"""Every block of the documents: what runs cheaply runs, everything else is read by gear's own parsers."""

from __future__ import annotations

import argparse
import ast
import importlib
import importlib.util
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from gear.cli.main import COMMANDS, module_of
from gear.cli.parser import Parser
from gear.config.load import load_collection
from gear.config.nodes import parse_file
from gear.config.reader import read_node
from gear.contracts.specs import KINDS
from gear.driving.config import DriveConfig
from gear.driving.drives import plan_drives
from gear.driving.scenario import load_scenarios
from gear.verbs.scaffold.write import new_package
from gear.world.scene_spec import SceneLibrary
from tests.docs.blocks import FENCES, ROOT, Block, all_blocks, blocks_of, commands, pages

SMALL_GEAR = Path(__file__).with_name("small_gear.py")

COLLECTION_FLAGS = ("task", "town", "scene", "split", "samples", "seed", "weather", "renderer", "quality")
"""Flags of `gear collect` that name nothing that only the reader has."""


def test_every_block_says_what_it_is() -> None:
    strange = [f"{block}: {block.fence or '(no fence)'}" for page in pages() for block in blocks_of(page)
               if block.fence not in FENCES]  # fmt: skip
    assert not strange


@pytest.mark.parametrize("block", all_blocks("yaml drive"), ids=str)
def test_drive_configs_can_be_planned(block: Block, tmp_path: Path) -> None:
    path = tmp_path / "drive.yml"
    path.write_text(block.text)
    assert plan_drives(read_node(DriveConfig, parse_file(path)), tmp_path).runs


@pytest.mark.parametrize("block", all_blocks("yaml scenarios"), ids=str)
def test_scenarios_can_be_read(block: Block, tmp_path: Path) -> None:
    path = tmp_path / "scenarios.yml"
    path.write_text(block.text)
    assert load_scenarios(str(path)).scenarios


@pytest.mark.parametrize("block", all_blocks("sh"), ids=str)
def test_commands_are_understood(block: Block) -> None:
    for command in commands(block):
        words = shlex.split(command)
        if words[0] == "gear":
            _parsed(words[1:])
        elif words[0] == "./run":
            assert f"\n    {words[1]})" in (ROOT / "run").read_text(), command
        elif words[:2] == ["python", "-m"]:
            assert importlib.util.find_spec(words[2]), command


def _parsed(words: list[str]) -> argparse.Namespace:
    """The arguments as the command's own parser reads them; the test fails where it refuses them."""
    assert words[0] in COMMANDS, words
    parser = Parser(prog=f"gear {words[0]}")
    importlib.import_module(module_of(words[0])).add_arguments(parser)
    try:
        args = parser.parse_args(words[1:])
    except SystemExit:
        pytest.fail(f"gear {shlex.join(words)}")
    if words[0] == "collect" and args.config is None:
        load_collection(None, {name: getattr(args, name) for name in COLLECTION_FLAGS}, args.settings)
    return args


@pytest.mark.parametrize("block", all_blocks("python parse"), ids=str)
def test_python_that_cannot_run_here_is_python(block: Block) -> None:
    ast.parse(block.text)


@pytest.mark.parametrize("block", all_blocks("xml"), ids=str)
def test_xml_is_well_formed(block: Block) -> None:
    ElementTree.fromstring(f"<root>{block.text}</root>")


@pytest.mark.parametrize("block", all_blocks("yaml collection", "yaml camera"), ids=str)
def test_a_collection_config_is_accepted(block: Block, tmp_path: Path) -> None:
    (tmp_path / "page.yml").write_text(block.text)
    flags = {"task": "stereo3d"} if block.fence == "yaml camera" else {}
    load_collection(str(tmp_path / "page.yml"), flags, [])


@pytest.mark.parametrize("block", all_blocks("yaml scenes"), ids=str)
def test_a_scene_library_is_accepted(block: Block, tmp_path: Path) -> None:
    (tmp_path / "page.yml").write_text(block.text)
    assert read_node(SceneLibrary, parse_file(tmp_path / "page.yml")).scenes


NEW_PACKAGE = """\
gear new {kind} {name}
cd gear-{kind}-{dashed}
python -m pip install -e '.[dev]'
gear plugins show {name}
python -m pytest
"""
"""What the pages for authors of plugins begin with."""


def _makes_a_package(block: Block) -> bool:
    """Whether a block does only what tests/verbs/scaffold/test_write.py does for packages of every kind."""
    made = re.match(r"gear new (\w+) (\w+)\n", block.text)
    if made is None or made[1] not in KINDS:
        return False
    return block.text == NEW_PACKAGE.format(kind=made[1], name=made[2], dashed=made[2].replace("_", "-"))


def _is_run_here(block: Block) -> bool:
    return block.fence == "python" or (block.fence == "sh run" and not _makes_a_package(block))


def test_the_commands_that_make_a_package_are_run_elsewhere(tmp_path: Path) -> None:
    made = [block for block in all_blocks("sh run") if _makes_a_package(block)]
    assert len(made) == len(KINDS) - 1, "all pages for authors but the tutorial for defenses"
    for block in made:
        words = block.text.split()
        readme = (new_package(words[2], words[3], out=tmp_path) / "README.md").read_text()
        for line in block.text.splitlines()[2:]:
            assert f"\n{line}\n" in readme, block


def _run_alone(page: Path) -> bool:
    """Whether the page's Python needs nothing from a shell block, so that it is quick."""
    return not any(_is_run_here(block) and block.fence == "sh run" for block in blocks_of(page))


def _pages_that_run() -> list[Path]:
    return [page for page in pages() if any(map(_is_run_here, blocks_of(page)))]


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=() if _run_alone(page) else pytest.mark.slow, id=str(page.relative_to(ROOT)))
        for page in _pages_that_run()
    ],
)
def test_the_blocks_of_a_page_run(page: Path, tmp_path: Path) -> None:
    """In an empty folder, with a `gear` that makes small pictures; packages are installed beside the environment."""
    work, site = tmp_path / "work", tmp_path / "site"
    work.mkdir()
    env = _tools(tmp_path / "bin", site)
    shell = "\n".join(block.text for block in blocks_of(page) if block.fence == "sh run" and _is_run_here(block))
    python = "\n".join(block.text for block in blocks_of(page) if block.fence == "python")
    if shell:
        _passes(["sh", "-eu", "-c", shell], work, env)
    if python:
        (work / "test_page.py").write_text(python + "\n\ndef test_a_page_of_the_site() -> None:\n    pass\n")
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-p",
            "no:cacheprovider",
            "--rootdir",
            str(work),
            "test_page.py",
        ]
        _passes(command, work, env)


def _tools(folder: Path, site: Path) -> dict[str, str]:
    """An environment in which `gear` and `python` are those of the tests."""
    folder.mkdir()
    python = shlex.quote(sys.executable)
    scripts = {
        "gear": f'exec {python} {SMALL_GEAR} "$@"',
        # Packages are installed into a folder; the tests' environment has what `.[dev]` asks for.
        "python": f'case "$*" in "-m pip install"*) set -- -m pip install -q --no-deps --target {site} . ;; esac\n'
        f'exec {python} "$@"',
    }
    for name, script in scripts.items():
        (folder / name).write_text(f"#!/bin/sh\n{script}\n")
        (folder / name).chmod(0o755)
    paths = {"PATH": f"{folder}:{os.environ['PATH']}", "PYTHONPATH": f"{site}:{ROOT}"}
    return os.environ | paths


def _passes(command: list[str], folder: Path, env: dict[str, str]) -> None:
    done = subprocess.run(command, cwd=folder, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
