"""YAML as a tree of texts: gear's own files are read by libyaml, and all files give the same trees and errors."""

from __future__ import annotations

from pathlib import Path

import pytest

from gear.config import nodes
from gear.config.nodes import parse_file, parse_text, text_of
from gear.values.errors import ConfigError
from gear.values.resources import data_dir

OWN_FILES = sorted(data_dir("configs").rglob("*.yml"))


@pytest.mark.parametrize("path", OWN_FILES, ids=lambda path: path.stem)
def test_gears_own_files_are_read_as_pyyaml_reads_them(path: Path) -> None:
    """Keys, texts, nulls, and the line and column of each."""
    assert parse_file(path) == parse_text(text_of(path), str(path))


def test_an_error_in_a_file_of_gears_own_is_worded_as_in_any_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    problems = []
    for folder in (tmp_path / "other", tmp_path):
        monkeypatch.setattr(nodes, "data_dir", lambda _, folder=folder: folder)
        for text in ("a: [1, 2", "a: b: c", "a: 1\na: 2", "%x", "- a\nb: 1", "a: &x [*x]", "a: \u0001"):
            path = tmp_path / "town.yml"
            path.write_text(text)
            with pytest.raises(ConfigError) as caught:
                parse_file(path)
            problems.append(str(caught.value))
    half = len(problems) // 2
    assert problems[:half] == problems[half:]


def test_only_files_of_gears_own_are_read_by_libyaml(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "town.yml").write_text("a: 1")
    monkeypatch.setattr(nodes, "_FAST_LOADER", None)
    parse_file(tmp_path / "town.yml")
    with pytest.raises(TypeError):
        parse_file(OWN_FILES[0])
