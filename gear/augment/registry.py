"""How samples of each class are moved; every task registers its own, in its own file."""

from __future__ import annotations

from typing import Any

from gear.augment.geometry import Geometry, SampleT
from gear.contracts.tasks import Sample

_GEOMETRIES: dict[type[Sample], Geometry[Any]] = {}


def register(kind: type[SampleT], geometry: Geometry[SampleT]) -> None:
    """Registers how samples of a class are moved. Call it in the module that defines the class, so that it holds
    wherever there are such samples.

    Raises:
        ValueError: the class has another geometry already.
    """
    if _GEOMETRIES.setdefault(kind, geometry) != geometry:
        raise ValueError(f"{kind.__name__} has a geometry already")


def geometry_of(sample: Sample) -> Geometry[Any] | None:
    """How a sample is moved; None where no geometry is registered for its class.

    A subclass does not inherit the geometry of its parent: it may have fields that the parent's geometry does not move.
    """
    return _GEOMETRIES.get(type(sample))
