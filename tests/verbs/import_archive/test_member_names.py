"""Paths of members of archives, checked as text."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.values.errors import DatasetError
from gear.verbs.import_archive.member_names import MemberNames


@pytest.mark.parametrize(
    ("path", "problem"),
    [
        ("../x", "not a path inside"),
        ("/etc/passwd", "not a path inside"),
        ("a\\b", "not a path inside"),
        ("a\nb", "control characters"),
        ("a\rgear: all is well", "control characters"),
        ("a\x1b[2J", "control characters"),
        ("a\0b", "control characters"),
        ("a\u202eb", "control characters"),
        ("a\udcff", "control characters"),
        ("/".join("d" * 65), "64 folders deep"),
        ("é" * 128, "more than 255 bytes"),
    ],
)
def test_odd_paths_are_refused_in_one_short_line(path: str, problem: str) -> None:
    with pytest.raises(DatasetError, match=problem) as caught:
        MemberNames(Path("a.tar")).check(path)
    assert str(caught.value).isprintable() and len(str(caught.value)) < 400


def test_ordinary_paths_pass() -> None:
    names = MemberNames(Path("a.tar"))
    for path in ("gear/test/plan.json", "straße/ünter den linden.png", "/".join("d" * 64), "x" * 255):
        names.check(path)
        names.add_file(path)
    names.check_folders()


@pytest.mark.parametrize(
    ("one", "other", "problem"),
    [
        ("gear/a", "gear/a", "'gear/a' twice"),
        ("gear/a", "GEAR/A", "'gear/a' and 'GEAR/A', which are one file"),
        ("caf\u00e9", "cafe\u0301", "one file on some"),
        ("straße", "STRASSE", "one file on some"),
    ],
)
def test_two_members_that_are_one_file_are_refused(one: str, other: str, problem: str) -> None:
    names = MemberNames(Path("a.tar"))
    names.add_file(one)
    with pytest.raises(DatasetError, match=problem):
        names.add_file(other)


@pytest.mark.parametrize("paths", [("a", "a/b"), ("a/b/c", "A")])
def test_a_file_that_is_a_folder_too_is_refused(paths: tuple[str, str]) -> None:
    names = MemberNames(Path("a.tar"))
    for path in paths:
        names.add_file(path)
    with pytest.raises(DatasetError, match="which is a file, too"):
        names.check_folders()
