"""The calibration pictures that show a patch, with their clean twins and the exact area of the patch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from gear.plugins.defenses.activations.twin_masks import patch_area
from gear.values.errors import GearError
from gear.values.frames import UInt8Image

Views = Mapping[str, UInt8Image]
Bool = npt.NDArray[np.bool_]


def visible_patches(
    clean: Sequence[Views], patched: Sequence[Views], most: int, defense: str
) -> list[tuple[UInt8Image, UInt8Image, Bool]]:
    """Returns clean picture, patched picture and (H, W) area of the patch, where a patch is visible.

    Args:
        clean: pictures without a patch, (H, W, 3) uint8 by camera name, one mapping per sample.
        patched: pictures of the same scenes with a patch, in the same order.
        most: largest number of samples that are read, spread over all samples.
        defense: name of the defense, for error messages.

    Raises:
        GearError: the pictures are no twins, or no patch is visible.
    """
    if not len(clean) or len(patched) != len(clean):
        raise GearError(
            f"{defense} learns from patches: give --calibration-patched DIR, the twin of --calibration with patches "
            f"(gear collect with the same seed and settings, and --patch random); got {len(clean)} clean samples, and "
            f"{len(patched)} with patches"
        )
    found = []
    for number in np.unique(np.linspace(0, len(clean) - 1, min(most, len(clean))).round().astype(int)):
        without, with_patch = clean[int(number)], patched[int(number)]
        for name, picture in with_patch.items():
            area = patch_area(without[name], picture, int(number))
            if area.any():
                found.append((without[name], picture, area))
    if not found:
        raise GearError(f"no patch is seen in the patched calibration data: {defense} has nothing to learn from")
    return found
