"""The factor by which pictures are resized before a network: from the user's options, or from the weights."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from gear.networks.options import LARGEST_SCALE
from gear.networks.shipped import resolve, trained_option
from gear.values.errors import GearError

OPTION = "input_scale"

NEGLIGIBLE = 0.02
"""Pictures whose widths differ by at most this share count as equally large."""


def width_share(width_px: int, usual_px: int) -> float:
    """Width of pictures as a share of the task's default width; 1 where the difference is negligible."""
    share = width_px / usual_px
    return 1.0 if abs(share - 1) <= NEGLIGIBLE else share


class Scaled(Protocol):
    """Options of a network with an `input_scale`."""

    @property
    def weights(self) -> str:
        """The option `gear.networks.options.NetworkOptions.weights`."""
        ...

    @property
    def input_scale(self) -> float | None:
        """Factor by which pictures are resized before the network; None for the one of the weights."""
        ...


def input_scale_of(options: Scaled, name: str, default: float = 1.0) -> float:
    """The factor by which pictures are resized before network `name`: above 0 and at most `LARGEST_SCALE`.

    Args:
        options: of the network.
        name: of the model plugin, for the shipped weights.
        default: where neither the options nor the weights state one.

    Raises:
        GearError: the weights do not exist, or what they state is no such factor.
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
            f"say --set {OPTION}=… yourself, or take another file"
        )
    return float(said)
