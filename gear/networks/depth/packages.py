"""Packages that some depth networks are built with, and that gear itself does not depend on."""

from __future__ import annotations

import importlib.util

from gear.networks import torchvision_import
from gear.values.errors import GearError


def need_transformers() -> None:
    """Makes transformers importable.

    Raises:
        GearError: it is not installed.
    """
    torchvision_import.prepare()
    _need("transformers")


def need_timm() -> None:
    """Makes timm importable.

    Raises:
        GearError: it, or torchvision, which it imports, is not installed.
    """
    torchvision_import.need()
    _need("timm")


def _need(package: str) -> None:
    if importlib.util.find_spec(package) is None:
        raise GearError(
            f"this network needs {package}: pip install 'mujoco-gear[models]', with the versions of constraints.txt"
        )
