"""Vehicle mixes: factors, by kind of vehicle, on the usual frequencies of vehicles."""

from __future__ import annotations

from collections.abc import Mapping

from gear.values.errors import FieldError
from gear.values.labels import VEHICLES

MAX_FACTOR = 1000.0


def check_mix(name: str, mix: Mapping[str, float]) -> None:
    """Checks that a vehicle mix names known kinds of vehicles and that at least one kind remains.

    Args:
        name: the field that holds the mix, for the error.
        mix: factors on the usual frequencies, by kind of vehicle; 0 means never.

    Raises:
        FieldError: a kind is unknown, a factor is out of range, or every kind has the factor 0.
    """
    for kind, factor in mix.items():
        if kind not in VEHICLES:
            raise FieldError(f"{name}.{kind}", f"is no kind of vehicle; there are {', '.join(VEHICLES)}")
        if not 0 <= factor <= MAX_FACTOR:
            raise FieldError(f"{name}.{kind}", f"must be 0 to {MAX_FACTOR:g}, got {factor:g}")
    if all(mix.get(kind) == 0 for kind in VEHICLES):
        raise FieldError(name, "leaves no vehicle; for streets without any, make their count 0")


def product_of(first: Mapping[str, float], second: Mapping[str, float]) -> dict[str, float]:
    """Combines two vehicle mixes (factors on frequencies, by kind): the products of their factors, for every kind
    that either mix names.

    Args:
        first, second: the two mixes, factors by kind of vehicle.
    """
    return {kind: first.get(kind, 1.0) * second.get(kind, 1.0) for kind in VEHICLES if kind in {*first, *second}}
