"""The functions that mirror, crop and resize samples, by class of sample. Every task registers its own."""

from __future__ import annotations

from typing import Any

from gear.augment.geometry import Geometry, SampleT
from gear.contracts.tasks import Sample

_GEOMETRIES: dict[type[Sample], Geometry[Any]] = {}


def register(kind: type[SampleT], geometry: Geometry[SampleT]) -> None:
    """Registers the functions that mirror, crop and resize samples of a class. Call it in the module that defines the
    class, so that it is registered wherever such samples exist.

    Raises:
        ValueError: another geometry is registered for the class.
    """
    if _GEOMETRIES.setdefault(kind, geometry) != geometry:
        raise ValueError(f"{kind.__name__} has a geometry already")


def geometry_of(sample: Sample) -> Geometry[Any] | None:
    """The functions registered for a sample's class; None if there are none.

    A subclass does not inherit the functions of its parent, because it may have fields that they do not change.
    """
    return _GEOMETRIES.get(type(sample))
