"""The checksums of the shipped weights, which change only together with the version of their package.

Every version of a weights file stays in the history for ever, so that weights are committed for releases alone.
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
    """The command takes none."""


def run(args: argparse.Namespace) -> int:
    """Writes the checksums of the weights as they are.

    Raises:
        GearError: weights changed and the version of their package did not.
    """
    refuse_without_version(LOCK, PACKAGE)
    LOCK.write_text(text(PACKAGE), encoding="utf-8")
    print(LOCK)
    return 0


def refuse_without_version(lock: Path, package: Path) -> None:
    """Refuses to replace the checksums of a version by others of the same version."""
    written = lock.read_text(encoding="utf-8") if lock.exists() else ""
    if written and written != text(package) and written.splitlines()[0] == text(package).splitlines()[0]:
        raise GearError(
            f"{lock}: weights changed and the version did not; raise it in {package / 'pyproject.toml'}, or keep the "
            "weights outside of the repository until the next release"
        )


def text(package: Path) -> str:
    """The version of the weights package, then the sha256 and the name of every weights file."""
    version = tomllib.loads((package / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    files = sorted((package / "gear_weights/models").glob("*.safetensors"))
    return "".join([f"version {version}\n", *(f"{sha256(path.read_bytes())}  {path.name}\n" for path in files)])
