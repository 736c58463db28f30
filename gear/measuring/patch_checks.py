"""Checks the patches that an attack returns."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from gear.contracts.attacks import Patch
from gear.measuring.guarded_model import plugin_error
from gear.plugins.catalogue import PluginEntry


def check_patches(patches: Any, surfaces: int, found: PluginEntry) -> None:
    """Checks that an attack returned one patch per surface, each (H, W, 3) float32 in 0..1.

    Args:
        patches: value that the attack returned.
        surfaces: number of surfaces of the scene.
        found: plugin of the attack.

    Raises:
        PluginError: the attack returned something else; the error names the attack.
    """
    names = [f"patch_{n}" for n in range(surfaces)]
    if not isinstance(patches, tuple) or not all(isinstance(patch, Patch) for patch in patches):
        raise plugin_error(found, "optimise", "must return a tuple of Patch")
    if [patch.name for patch in patches] != names:
        raise plugin_error(found, "optimise", f"must return {', '.join(names)}")
    for patch in patches:
        if not is_picture(patch.rgb):
            raise plugin_error(found, "optimise", f"{patch.name} must be (H, W, 3) float32 without NaN")
        if patch.rgb.min() < 0 or patch.rgb.max() > 1:
            raise plugin_error(found, "optimise", f"{patch.name} leaves 0..1")


def is_picture(rgb: npt.NDArray[Any]) -> bool:
    """Whether the array `rgb` has the form of a patch: (H, W, 3) float32 with finite values."""
    return rgb.dtype == np.float32 and rgb.ndim == 3 and rgb.shape[2] == 3 and bool(np.isfinite(rgb).all())
