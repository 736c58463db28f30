"""Registry of the functions that mirror, crop and resize samples, by class of sample. Every task registers its own
functions.
"""

from __future__ import annotations

from typing import Any

from gear.augment.geometry import Geometry, SampleT
from gear.contracts.tasks import Sample

_GEOMETRIES: dict[type[Sample], Geometry[Any]] = {}


def register(kind: type[SampleT], geometry: Geometry[SampleT]) -> None:
    """Registers the functions that mirror, crop and resize the samples of a class.

    Call `register` in the module that defines the class; the functions are then known wherever such samples exist.

    Args:
        kind: class of the samples.
        geometry: functions that mirror, crop and resize a sample.

    Raises:
        ValueError: other functions are already registered for the class.
    """
    if _GEOMETRIES.setdefault(kind, geometry) != geometry:
        raise ValueError(f"{kind.__name__} has a geometry already")


def geometry_of(sample: Sample) -> Geometry[Any] | None:
    """Returns the functions that mirror, crop and resize a sample, as registered for its class; None if there are
    none.

    A subclass does not inherit the functions of its parent, because it may have fields that these functions do not
    change.

    Args:
        sample: a sample of any task.
    """
    return _GEOMETRIES.get(type(sample))
