"""States in the names of curves and figures which direction is better."""

from __future__ import annotations

UP, DOWN = "up is better", "down is better"

FOR_THE_ATTACK = "for the attack"
"""Addition to a direction in the figures of attacks, whose success is the network's failure."""


def with_direction(name: str, *, lower_is_better: bool | None, whose: str = "") -> str:
    """Returns the name of a curve with its direction in brackets, such as `loss (down is better)`.

    Args:
        name: name of the curve.
        lower_is_better: whether lower values are better; None leaves the name as it is, for curves without a better
            direction, such as a learning rate.
        whose: for whom the direction is better, such as `for the attack`; "" for nobody in particular.
    """
    if lower_is_better is None:
        return name
    return f"{name} ({' '.join(filter(None, (DOWN if lower_is_better else UP, whose)))})"
