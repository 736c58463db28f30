"""New folders that appear complete or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.dataset.whole_tree import check_target, unfinished_place, whole_tree
from gear.values.errors import DatasetError


def test_a_folder_appears_when_it_is_complete(tmp_path: Path) -> None:
    target = tmp_path / "new"
    with whole_tree(target, "export") as folder:
        (folder / "a").write_text("a")
        assert not target.exists()
        assert folder.parent == tmp_path
    assert (target / "a").read_text() == "a"
    assert [path.name for path in tmp_path.iterdir()] == ["new"]


@pytest.mark.parametrize(
    ("error", "is_kept", "stays"),
    [(ValueError, True, False), (KeyboardInterrupt, True, True), (KeyboardInterrupt, False, False)],
)
def test_after_an_error_nothing_appears(error: type[BaseException], is_kept: bool, stays: bool, tmp_path: Path) -> None:
    target = tmp_path / "new"
    with pytest.raises(error), whole_tree(target, "merge", is_kept=is_kept) as folder:
        (folder / "a").write_text("a")
        raise error
    assert not target.exists()
    assert unfinished_place(target, "merge").exists() == stays


def test_a_folder_with_content_and_the_current_one_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full/a").write_text("mine")
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    with pytest.raises(DatasetError, match="full: is not empty; export into a new folder"):
        check_target(tmp_path / "full", "export")
    with pytest.raises(DatasetError, match="here: is the current folder"):
        check_target(tmp_path / "here", "export")
    check_target(tmp_path / "missing", "export")


def test_a_link_in_the_hidden_folder_is_refused(tmp_path: Path) -> None:
    hidden = unfinished_place(tmp_path / "new", "export")
    hidden.mkdir()
    (tmp_path / "victim").mkdir()
    for name in ("link", ".link", "inner/.deeper/link"):
        (hidden / name).parent.mkdir(parents=True, exist_ok=True)
        (hidden / name).symlink_to(tmp_path / "victim")
        with pytest.raises(DatasetError, match="link: is a link"):
            unfinished_place(tmp_path / "new", "export")
        (hidden / name).unlink()


def test_a_command_that_does_not_continue_begins_with_an_empty_folder(tmp_path: Path) -> None:
    target, hidden = tmp_path / "new", tmp_path / ".new.gear-import"
    (tmp_path / "victim").mkdir()
    (tmp_path / "victim/mine").write_text("mine")
    (hidden / "inner/.deeper").mkdir(parents=True)
    for name in ("setup.py", "inner/a"):
        (hidden / name).write_text("of a killed run")
    for name in ("link", "inner/.deeper/link"):
        (hidden / name).symlink_to(tmp_path / "victim")
    with whole_tree(target, "import", is_continued=False) as folder:
        assert folder == hidden and not list(folder.iterdir())
        (folder / "b").write_text("b")
    assert [path.name for path in target.iterdir()] == ["b"]
    assert (tmp_path / "victim/mine").read_text() == "mine"


def test_a_command_that_continues_keeps_the_files(tmp_path: Path) -> None:
    (tmp_path / ".new.gear-merge").mkdir()
    (tmp_path / ".new.gear-merge/a").write_text("a")
    with whole_tree(tmp_path / "new", "merge"):
        pass
    assert (tmp_path / "new/a").read_text() == "a"


def test_a_hidden_folder_that_is_a_link_is_refused(tmp_path: Path) -> None:
    (tmp_path / "victim").mkdir()
    (tmp_path / "victim/mine").write_text("mine")
    (tmp_path / ".new.gear-import").symlink_to(tmp_path / "victim")
    with pytest.raises(DatasetError, match="is a link"), whole_tree(tmp_path / "new", "import", is_continued=False):
        pass
    assert (tmp_path / "victim/mine").read_text() == "mine"
