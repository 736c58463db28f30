"""Shipped weights change only together with the version of their package."""

from __future__ import annotations

from pathlib import Path

import pytest

from authoring.weights.lock import LOCK, PACKAGE, refuse_without_version, text
from gear.values.errors import GearError


@pytest.fixture
def package(tmp_path: Path) -> Path:
    (tmp_path / "gear_weights/models").mkdir(parents=True)
    (tmp_path / "gear_weights/models/net.safetensors").write_bytes(b"weights")
    (tmp_path / "pyproject.toml").write_text('[project]\nversion = "1.0"\n')
    (tmp_path / "checksums.txt").write_text(text(tmp_path))
    return tmp_path


def test_the_shipped_weights_are_those_of_their_version() -> None:
    assert LOCK.read_text() == text(PACKAGE), "CONTRIBUTING.md says how new weights come in"


def test_unchanged_weights_are_accepted(package: Path) -> None:
    refuse_without_version(package / "checksums.txt", package)


def test_changed_weights_of_the_same_version_are_refused(package: Path) -> None:
    (package / "gear_weights/models/net.safetensors").write_bytes(b"others")
    with pytest.raises(GearError, match="raise it in"):
        refuse_without_version(package / "checksums.txt", package)


def test_changed_weights_of_another_version_are_accepted(package: Path) -> None:
    (package / "gear_weights/models/net.safetensors").write_bytes(b"others")
    (package / "pyproject.toml").write_text('[project]\nversion = "1.1"\n')
    refuse_without_version(package / "checksums.txt", package)
