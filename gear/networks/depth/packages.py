"""Imports the optional packages of depth networks; the error for a missing package states what to install."""

from __future__ import annotations

import importlib.util

from gear.networks import torchvision_import
from gear.values.errors import GearError


def need_transformers() -> None:
    """Imports the optional package transformers.

    Raises:
        GearError: transformers is not installed.
    """
    torchvision_import.prepare()
    _need("transformers")


def need_timm() -> None:
    """Imports the optional package timm.

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
