"""Imports the optional packages of depth networks; a missing package gives a clear error."""

from __future__ import annotations

import importlib.util

from gear.networks import torchvision_import
from gear.values.errors import GearError


def need_transformers() -> None:
    """Imports the package transformers.

    Raises:
        GearError: transformers is not installed.
    """
    torchvision_import.prepare()
    _need("transformers")


def need_timm() -> None:
    """Imports the package timm.

    Raises:
        GearError: timm is not installed, or torchvision is not, which timm imports.
    """
    torchvision_import.need()
    _need("timm")


def _need(package: str) -> None:
    if importlib.util.find_spec(package) is None:
        raise GearError(
            f"this network needs {package}: pip install 'mujoco-gear[models]', with the versions of constraints.txt"
        )
