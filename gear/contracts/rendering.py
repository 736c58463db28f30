"""The protocol of renderers: their input (a posed MuJoCo model and cameras) and their output (colour, depth and
geom ids).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, Protocol

import numpy as np
import numpy.typing as npt

from gear.values.frames import FloatImage, IdImage, UInt8Image, UInt16Image
from gear.values.scene import CameraRecord, Vec3

if TYPE_CHECKING:
    import mujoco

Quality = Literal["film", "fast"]
"""Quality of rendering. `film`: 2x2 supersampling, averaged in linear light. `fast`: one sample per pixel with
gear's own edge filter.

With `film`, `raster` takes one sample where four samples would be equal. `gear.render.raster.renderer`,
`gear.render.filament` and `gear.render.classic` implement both qualities.
"""

FULL_SCALE_LUX = 38400.0
"""Luminance in cd/m² that gives the largest pixel value at Filament's fixed exposure (f/16, 1/125 s, ISO 100).
Intensities of lights in lux are divided by this value.
"""

NO_OWN_RGBA = (0.5, 0.5, 0.5, 1.0)
"""MuJoCo's default colour (RGBA) of a geom; a geom with this colour is rendered in the colour of its material."""

Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Stage:
    """A compiled MuJoCo model with all objects posed for one sample: the input of a renderer.

    Attributes:
        model: the render model; the same for all samples.
        data: poses of the sample; kinematics, lights and cameras are up to date.
        paint_rgb: linear albedo (0..1) by geom id, for geoms whose colour this sample chose.
        faces: pictures on the surfaces: sRGB albedo, (H, W, 3) uint8, by geom id of the face; all of the same size.
        is_absent: (ngeom,) bool, geoms of actors that this sample does not use and that wait under the ground; a
            renderer may leave them out. None if there are none.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    paint_rgb: Mapping[int, Vec3] = field(default_factory=dict)
    faces: Mapping[int, UInt8Image] = field(default_factory=dict)
    is_absent: Bools | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RendererInfo:
    """Name, graphics driver and device of a renderer, as written to every manifest.

    Attributes:
        name: `raster`, `filament` or `classic`.
        backend: graphics interface: `vulkan`, `osmesa`, `egl`.
        driver: name and version that the driver reports.
        device: name that the device reports.
        is_software: whether the CPU renders.
    """

    name: str
    backend: str
    driver: str
    device: str
    is_software: bool


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class RawView:
    """The output of a renderer for one camera: pixel-aligned arrays, row 0 at the top.

    Attributes:
        linear_rgb: (H, W, 3) uint16, 0..`LINEAR_FULL_SCALE`, linear in the albedo of every surface's face; None if no
            colour was requested.
        depth_m: (H, W) float32 distance along the optical axis; NaN where no geom was hit.
        geom_id: (H, W) int32 MuJoCo geom ids; -1 where no geom was hit.
    """

    linear_rgb: UInt16Image | None
    depth_m: FloatImage
    geom_id: IdImage


def has_own_colour(model: mujoco.MjModel) -> Bools:
    """The (ngeom,) bool mask of the geoms that MuJoCo renders in their own rgba colour, not in the colour of their
    material.

    Args:
        model: compiled model.
    """
    is_said = (model.geom_rgba != np.array(NO_OWN_RGBA, np.float32)).any(axis=1)
    return np.asarray(is_said | (model.geom_matid < 0), np.bool_)


class Renderer(Protocol):
    """A renderer of one compiled model. A frame depends only on stage and camera, never on earlier frames."""

    @property
    def info(self) -> RendererInfo:
        """Name, graphics driver and device of this renderer."""
        ...

    def render(
        self,
        stage: Stage,
        cameras: Sequence[CameraRecord],
        *,
        colour: bool = True,
        shapes: Sequence[RawView] | None = None,
    ) -> tuple[RawView, ...]:
        """Renders one raw view for each camera, in order.

        Args:
            stage: the posed model.
            cameras: resolved cameras of the scene.
            colour: whether `linear_rgb` is rendered as well.
            shapes: views of the same cameras on a stage that differs only in paint and faces; their depth and ids are
                reused, which saves two passes.
        """
        ...

    def close(self) -> None:
        """Releases the graphics context; may be called twice."""
        ...
