"""Optional packages of depth networks, imported with a clear error where they are missing."""

from __future__ import annotations

import importlib.util

from gear.networks import torchvision_import
from gear.values.errors import GearError


def need_transformers() -> None:
    """Imports transformers.

    Raises:
        GearError: it is not installed.
    """
    torchvision_import.prepare()
    _need("transformers")


def need_timm() -> None:
    """Imports timm.

    Raises:
        GearError: timm, or torchvision, which timm imports, is not installed.
    """
    torchvision_import.need()
    _need("timm")


def _need(package: str) -> None:
    if importlib.util.find_spec(package) is None:
        raise GearError(
            f"this network needs {package}: pip install 'mujoco-gear[models]', with the versions of constraints.txt"
        )
