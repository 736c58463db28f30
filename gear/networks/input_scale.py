"""Finds the factor by which pictures are resized before a network: from the user's options, or from the weights
file.
"""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from gear.networks.options import LARGEST_SCALE
from gear.networks.shipped import resolve, trained_option
from gear.values.errors import GearError

OPTION = "input_scale"

NEGLIGIBLE = 0.02
"""Largest relative difference between two widths of pictures that count as equal."""


def width_share(width_px: int, usual_px: int) -> float:
    """Width of the pictures divided by the task's default width; 1 if the difference is negligible.

    Args:
        width_px: width of the pictures.
        usual_px: the task's default width.
    """
    share = width_px / usual_px
    return 1.0 if abs(share - 1) <= NEGLIGIBLE else share


class Scaled(Protocol):
    """Protocol of a network's options that include `input_scale`."""

    @property
    def weights(self) -> str:
        """Source of the weights: `shipped`, `none`, or the path of a file (`gear.networks.options.NetworkOptions`)."""
        ...

    @property
    def input_scale(self) -> float | None:
        """Factor by which pictures are resized before the network; None takes the factor of the weights."""
        ...


def input_scale_of(options: Scaled, name: str, default: float = 1.0) -> float:
    """Returns the factor by which pictures are resized before a network; above 0 and at most `LARGEST_SCALE`.

    Args:
        options: options of the network; a factor in them comes first, then that of the weights file that they select.
        name: name of the model plugin, which determines the shipped weights.
        default: result if neither the options nor the weights state a factor.

    Raises:
        GearError: the weights do not exist, or they state a factor out of range.
    """
    if options.input_scale is not None:
        return options.input_scale
    said = trained_option(options.weights, name, OPTION)
    if said is None:
        return default
    if isinstance(said, bool) or not isinstance(said, (int, float)) or not 0 < said <= LARGEST_SCALE:
        path: Path | None = resolve(options.weights, name)
        raise GearError(
            f"{path}: says input_scale {said!r}, which is no number above 0 and at most {LARGEST_SCALE:g}; "
            f"say --model-set {OPTION}=… yourself, or take another file"
        )
    return float(said)
