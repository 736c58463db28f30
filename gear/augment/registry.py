"""Which samples can be moved, and how; third parties add theirs."""

from __future__ import annotations

from typing import Any

from gear.augment import depth, detect2d, semseg, stereo3d
from gear.augment.geometry import Geometry, SampleT
from gear.contracts.tasks import Sample
from gear.plugins.tasks.depth import DepthSample
from gear.plugins.tasks.detect2d import Detect2dSample
from gear.plugins.tasks.semseg import SemsegSample
from gear.plugins.tasks.stereo3d import Stereo3dSample

_GEOMETRIES: dict[type[Sample], Geometry[Any]] = {
    SemsegSample: semseg.GEOMETRY,
    DepthSample: depth.GEOMETRY,
    Detect2dSample: detect2d.GEOMETRY,
    Stereo3dSample: stereo3d.GEOMETRY,
}


def register(kind: type[SampleT], geometry: Geometry[SampleT]) -> None:
    """Says how samples of a class are moved. Call it where a package's task is built: it then holds whenever there are
    such samples.

    Raises:
        ValueError: the class has another geometry already.
    """
    if _GEOMETRIES.setdefault(kind, geometry) != geometry:
        raise ValueError(f"{kind.__name__} has a geometry already")


def geometry_of(sample: Sample) -> Geometry[Any] | None:
    """How a sample is moved, or None where nobody said.

    A subclass does not inherit: it may have fields that its parent's geometry would leave where they were.
    """
    return _GEOMETRIES.get(type(sample))
