"""How often kinds of vehicles come, times their usual share."""

from __future__ import annotations

from collections.abc import Mapping

from gear.values.errors import FieldError

VEHICLE_KINDS = ("car", "van", "truck", "bus", "motorcycle", "bicycle")

MOST_MIXED = 1000.0


def check_mix(name: str, mix: Mapping[str, float]) -> None:
    """Whether factors are of kinds of vehicles, and leave some.

    Raises:
        FieldError: they are not; `name` is what the mix is called.
    """
    for kind, factor in mix.items():
        if kind not in VEHICLE_KINDS:
            raise FieldError(f"{name}.{kind}", f"is no kind of vehicle; there are {', '.join(VEHICLE_KINDS)}")
        if not 0 <= factor <= MOST_MIXED:
            raise FieldError(f"{name}.{kind}", f"must be 0 to {MOST_MIXED:g}, got {factor:g}")
    if all(mix.get(kind) == 0 for kind in VEHICLE_KINDS):
        raise FieldError(name, "leaves no vehicle; for streets without any, make their count 0")


def product_of(first: Mapping[str, float], second: Mapping[str, float]) -> dict[str, float]:
    """Both, one after the other."""
    return {kind: first.get(kind, 1.0) * second.get(kind, 1.0) for kind in VEHICLE_KINDS if kind in {*first, *second}}
