"""Writes the checksums of the shipped weights, which change only together with the version of their package.

Every committed version of a weights file stays in git's history, so weights are committed only for releases.
"""

from __future__ import annotations

import argparse
import tomllib
from pathlib import Path

from gear.dataset.files import sha256
from gear.networks.shipped import CHECKOUT
from gear.values.errors import GearError

PACKAGE = CHECKOUT.parent
LOCK = PACKAGE / "checksums.txt"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds nothing: the command has no arguments."""


def run(args: argparse.Namespace) -> int:
    """Writes the checksums of the current weights files.

    Raises:
        GearError: weights have changed, but the version of their package has not.
    """
    refuse_without_version(LOCK, PACKAGE)
    LOCK.write_text(text(PACKAGE), encoding="utf-8")
    print(LOCK)
    return 0


def refuse_without_version(lock: Path, package: Path) -> None:
    """Checks that changed weights have a new version.

    Args:
        lock: file of checksums; it may be absent.
        package: folder of the weights package.

    Raises:
        GearError: the checksums differ from those in the file, but the version is the same.
    """
    written = lock.read_text(encoding="utf-8") if lock.exists() else ""
    if written and written != text(package) and written.splitlines()[0] == text(package).splitlines()[0]:
        raise GearError(
            f"{lock}: weights have changed, but the version has not; raise it in {package / 'pyproject.toml'}, or keep "
            "the weights outside the repository until the next release"
        )


def text(package: Path) -> str:
    """Returns the content of the file: the version of the weights package, then SHA-256 and name of each file."""
    version = tomllib.loads((package / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    files = sorted((package / "gear_weights/models").glob("*.safetensors"))
    return "".join([f"version {version}\n", *(f"{sha256(path.read_bytes())}  {path.name}\n" for path in files)])
