"""The list of an export: what it names, and what is found when the files differ from it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gear.dataset.checks.exported_files import AT_ADDRESS, LISTED, check_export, export_list, list_of_export
from gear.dataset.files import sha256
from gear.values.errors import DatasetError


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """An export with two files, and its list."""
    folder = tmp_path / "export"
    (folder / "deep").mkdir(parents=True)
    contents = {"a.txt": b"first", "deep/b.txt": b"second"}
    for name, data in contents.items():
        (folder / name).write_bytes(data)
    files = {name: {"bytes": len(data), "sha256": sha256(data)} for name, data in contents.items()}
    (folder / LISTED).write_bytes(export_list({"layout": "coco"}, files))
    return folder


def problems(root: Path) -> dict[str, str]:
    """The problem of each file by its path; the progress must count all files."""
    seen: list[tuple[int, int]] = []
    count, found = check_export(root, root / LISTED, lambda done, total: seen.append((done, total)))
    assert count == 2 and seen == [(1, 2), (2, 2)]
    return {one.path: one.problem for one in found}


def test_whole_files_have_no_problem_and_others_do_not_count(root: Path) -> None:
    (root / "cache.npy").write_bytes(b"of another tool")
    assert problems(root) == {}


def test_a_changed_a_missing_and_a_foreign_file_are_found(root: Path, tmp_path: Path) -> None:
    (root / "a.txt").write_bytes(b"firsT")
    (root / "deep/b.txt").unlink()
    assert problems(root) == {"a.txt": "damaged", "deep/b.txt": "missing"}
    (tmp_path / "elsewhere.txt").write_bytes(b"second")
    (root / "deep/b.txt").symlink_to(tmp_path / "elsewhere.txt")  # equal bytes, but not in the export
    assert problems(root)["deep/b.txt"] == "damaged"


def test_the_list_is_found_in_a_folder_and_in_the_copy_of_an_address(root: Path) -> None:
    assert list_of_export(root) == root / LISTED
    (root / LISTED).rename(root / AT_ADDRESS)
    assert list_of_export(root) == root / AT_ADDRESS
    (root / AT_ADDRESS).unlink()
    assert list_of_export(root) is None


def test_a_damaged_list_is_one_line_that_says_what_to_do(root: Path) -> None:
    text = (root / LISTED).read_text()
    for damaged in (text.replace("first", "x").replace("a.txt", "c.txt"), "{}", "[", json.dumps({"files": 3})):
        (root / LISTED).write_text(damaged)
        with pytest.raises(DatasetError, match="export the dataset again"):
            check_export(root, root / LISTED, lambda done, total: None)
