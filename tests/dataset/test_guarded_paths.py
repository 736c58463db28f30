from __future__ import annotations

import ast
import re
from collections.abc import Callable
from pathlib import Path

import pytest

import gear
from gear.dataset import guarded_paths
from gear.dataset.files import write_whole
from gear.dataset.guarded_paths import (
    inside,
    owned,
    refuse_links,
    remove_empty_folders,
    remove_file,
    remove_files,
    remove_tree,
)
from gear.values.errors import DatasetError
from tests.dataset.splits import tree

ALLOWED = {
    "dataset/files.py": {"replace", "unlink"},  # of a half-written file that it has just made
    "dataset/guarded_paths.py": {"unlink", "rmdir", "rmtree"},
    "dataset/scratch.py": {"unlink", "rmdir"},
    "dataset/store.py": {"rmdir"},  # of empty folders at and above the root, that this run has made
    "dataset/whole_tree.py": {"replace"},  # of the whole tree into its place
    "plugins/loggers/event_file.py": {"open"},  # a new file, in a folder that `run_log` has checked
    "plugins/probe.py": {"replace"},  # gear's own cache
    "plugins/probe_process.py": {"open"},  # a temporary file of the parent process
    "verbs/scaffold/write.py": {"rename", "rmtree", "write_text"},  # of a folder that it has just made
    "verbs/verify/recipe.py": {"write_bytes"},  # into a temporary folder
    "world/compilation/world_cache.py": {"rename", "rmtree", "unlink", "open"},  # gear's own cache
    "camera/occlusion_cache.py": {"replace", "unlink"},  # likewise
    "world/compilation/mjb.py": {"open"},  # likewise
    "values/array_shelf.py": {"replace", "unlink"},  # likewise
    "world/compilation/compiled_world.py": {"write_text"},  # into a temporary folder
    "world/compilation/compose.py": {"write_bytes"},  # likewise
}
"""Modules that delete, rename or write without `guarded_paths`, and why that is safe."""

CHANGES = {
    "unlink", "rmdir", "rmtree", "rename", "renames", "removedirs", "write_bytes", "write_text", "symlink_to",
    "hardlink_to", "copytree", "copy2", "copyfile", "move",
}  # fmt: skip


@pytest.fixture
def victim(tmp_path: Path) -> Path:
    """A folder with files, outside of the root."""
    folder = tmp_path / "victim"
    (folder / "inner").mkdir(parents=True)
    (folder / "mine.json").write_text("mine")
    (folder / "inner/mine.txt").write_text("mine")
    return folder


@pytest.fixture
def root(tmp_path: Path, victim: Path) -> Path:
    """A folder with a link out of it, and a link to a file out of it."""
    folder = tmp_path / "root"
    (folder / "a").mkdir(parents=True)
    (folder / "a/link").symlink_to(victim)
    (folder / "a/file.json").symlink_to(victim / "mine.json")
    return folder


def test_only_the_guard_deletes_renames_and_writes() -> None:
    """A new place that does must go through `guarded_paths`, or say here why it need not."""
    package, found = Path(gear.__file__).parent, dict[str, set[str]]()
    words = re.compile("|".join([*CHANGES, r"\.open\(", r"\.replace\((?!['\"])"]))
    for path in package.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if path.is_relative_to(package / "testing") or not words.search(text):
            continue
        for node in ast.walk(ast.parse(text)):
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
                continue
            name, of = node.func.attr, node.func.value
            is_path_replace = name == "replace" and len(node.args) == 1 and not node.keywords
            is_os_replace = name == "replace" and isinstance(of, ast.Name) and of.id == "os"
            mode = node.args[0].value if name == "open" and node.args and isinstance(node.args[0], ast.Constant) else ""
            is_write = isinstance(mode, str) and bool(set("wax+") & set(mode))
            if name in CHANGES or is_path_replace or is_os_replace or is_write:
                found.setdefault(path.relative_to(package).as_posix(), set()).add(name)
    assert not {name: more for name, kinds in found.items() if (more := kinds - ALLOWED.get(name, set()))}


@pytest.mark.parametrize("relative", ["a/link/mine.json", "a/link", "a/file.json", "a/link/new/file"])
@pytest.mark.parametrize(
    "change",
    [
        owned,
        remove_file,
        remove_tree,
        lambda root, relative: remove_files(root, ["a/b", relative]),
        lambda root, relative: remove_empty_folders(root, relative),
        lambda root, relative: write_whole(root, relative, b"new"),
    ],
)
def test_nothing_changes_through_a_link(
    root: Path, victim: Path, relative: str, change: Callable[[Path, str], object]
) -> None:
    (root / "a/b").write_text("b")
    before = tree(victim), tree(root)
    with pytest.raises(DatasetError, match=r"is a link; gear writes and deletes nothing through links"):
        change(root, relative)
    assert (tree(victim), tree(root)) == before
    assert (root / "a/link").is_symlink() and (root / "a/file.json").is_symlink()


def test_a_link_that_is_made_after_the_check_is_refused(
    tmp_path: Path, victim: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = tmp_path / "data"
    (root / "a").mkdir(parents=True)
    (root / "a/mine.json").write_text("doomed")

    def checked_too_early(root: Path, relative: str) -> Path:
        return root / relative

    monkeypatch.setattr(guarded_paths, "owned", checked_too_early)
    refuse_links(root)
    (root / "a").rename(tmp_path / "elsewhere")
    (root / "a").symlink_to(victim)
    with pytest.raises(DatasetError, match="is a link"):
        remove_files(root, ["a/mine.json"])
    with pytest.raises(DatasetError, match="is a link"):
        write_whole(root, "a/mine.json", b"new")
    assert (victim / "mine.json").read_text() == "mine"


def test_links_are_found_wherever_they_lie(root: Path, tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match=r"root/a/(link|file.json): is a link"):
        refuse_links(root)
    whole = tmp_path / "whole"
    (whole / ".venv").mkdir(parents=True)
    (whole / ".venv/python").symlink_to(tmp_path)
    refuse_links(whole)
    refuse_links(tmp_path / "missing")
    (whole / "loop").symlink_to("loop")
    with pytest.raises(DatasetError, match="loop: is a link"):
        refuse_links(whole)
    with pytest.raises(DatasetError, match="leads nowhere"):
        inside(whole, "loop/x")
    through = tmp_path / "through"
    (whole / "loop").unlink()
    through.symlink_to(whole)
    refuse_links(through)  # the root is the user's own choice
    write_whole(through, "a/b", b"1")
    assert (whole / "a/b").read_bytes() == b"1"


def test_folders_are_removed_where_they_are_empty(tmp_path: Path) -> None:
    (tmp_path / "a/b/c").mkdir(parents=True)
    (tmp_path / "a/d").mkdir()
    (tmp_path / "a/d/mine").write_text("mine")
    remove_empty_folders(tmp_path, "a")
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["a", "d", "mine"]
    remove_empty_folders(tmp_path, "nowhere")


def test_links_inside_a_removed_folder_are_not_followed(root: Path, victim: Path) -> None:
    before = tree(victim)
    remove_tree(root, "a")
    assert tree(victim) == before and not [*root.iterdir()]
    remove_tree(root, "a")


def test_a_folder_in_the_place_of_a_file_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    with pytest.raises(DatasetError, match=r"a: (a folder is where a file should be|no permission)"):
        remove_file(tmp_path, "a")
