"""Titles of an attack's curves, which state which direction is better."""

from __future__ import annotations

from gear.reporting.directions import FOR_THE_ATTACK, with_direction

UNDIRECTED = frozenset({"gradient", "queries_left", "smoothness", "printability"})
"""Names of curves without a better direction. Attacks report the regularisers of a patch with either sign."""

HELD_OUT = "objective on validation samples"
"""Name of the curve of the validations."""


def curve_title(name: str) -> str:
    """Returns the name of a curve of an attack with its direction, such as `miss (up is better for the attack)`.

    Terms of an objective grow with the harm that the patch does.

    Args:
        name: name of the value that the attack reported.
    """
    is_term = name.rpartition("/")[2] not in UNDIRECTED
    return with_direction(name, lower_is_better=False if is_term else None, whose=FOR_THE_ATTACK)
