"""Renders the probes of a sample: the same scene once more with black and with white patch surfaces.

A white surface in full low sun is brighter than the largest value of a picture. Its pixels are clipped, and would make
every patch too dark. Such a surface is also rendered in grey, and the unclipped white is extrapolated from it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gear.camera.pipeline import CameraPipeline
from gear.camera.reflection import Reflection
from gear.camera.response import face_light
from gear.contracts.rendering import RawView, Renderer
from gear.dataset.probe_files import Probe, crop_probe
from gear.values.frames import LINEAR_FULL_SCALE, GeomTable, UInt16Image
from gear.values.scene import SceneRecord
from gear.world.world import PlacedStage, World

Raws = tuple[RawView, ...]
"""Raw renders of one scene, one view per camera."""

UNSURE = 8
"""Largest difference between extrapolated and rendered white that rounding can cause, in levels of linear uint16."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ProbeShot:
    """The renders of one scene from which its probes are computed.

    Attributes:
        black: one view per camera, with all surfaces black.
        white: one view per camera, by surface: this surface white and all others black.
        grey: one view per camera with this surface grey, for surfaces whose white is clipped.
        grey_weight: linear albedo of the grey as a share of the albedo of white.
    """

    black: Raws
    white: Mapping[str, Raws]
    grey: Mapping[str, Raws]
    grey_weight: float


def shoot_probes(world: World, renderer: Renderer, placed: PlacedStage, record: SceneRecord, shapes: Raws) -> ProbeShot:
    """Renders the scene that was placed last, once with all surfaces black and once per surface with only this
    surface white.

    Args:
        world: world of the scene.
        renderer: renderer of that world.
        placed: the placed scene.
        record: scene record with cameras and surfaces.
        shapes: views of the sample itself; their depth and object ids are used again.
    """
    names = [surface.name for surface in record.surfaces]
    weights = face_light(renderer.info.name, np.arange(256, dtype=np.uint8))
    half = int(np.searchsorted(weights, 0.5))

    def seen(name: str | None, byte: int) -> Raws:
        shown = np.full((1, 1, 3), byte, np.uint8)
        stage = world.with_surfaces(placed, {other: shown if other == name else "black" for other in names})
        return renderer.render(stage, record.cameras, shapes=shapes)

    black = seen(None, 0) if names else ()
    white = {name: seen(name, 255) for name in names}
    clipped = [name for name, raws in white.items() if any(map(_is_clipped, black, raws))]
    return ProbeShot(
        black=black,
        white=white,
        grey={name: seen(name, half) for name in clipped},
        grey_weight=float(weights[half]),
    )


def _is_clipped(black: RawView, white: RawView) -> bool:
    assert black.linear_rgb is not None and white.linear_rgb is not None
    return bool(((white.linear_rgb >= LINEAR_FULL_SCALE) & (white.linear_rgb != black.linear_rgb)).any())


def compute_probes(
    pipeline: CameraPipeline,
    shot: ProbeShot,
    record: SceneRecord,
    geoms: GeomTable,
    reflections: Sequence[Reflection | None],
) -> list[Probe]:
    """Computes the probes of one sample, for all surfaces and cameras.

    Args:
        pipeline: camera pipeline of the sample; its noise is left out.
        shot: renders with black, white and grey surfaces.
        record: the scene record.
        geoms: classes of the geoms.
        reflections: reflections of wet ground in the sample, one per camera; None for dry ground.
    """
    quiet = replace(pipeline, effects=pipeline.effects.linear())
    probes = []
    for number, camera in enumerate(record.cameras if shot.white else ()):
        mirrored = reflections[number]
        lamps = quiet.night_light(shot.black[number], camera, record, geoms)
        black = quiet.view(shot.black[number], camera, record, geoms, lamps, mirrored).linear_rgb
        for surface, raws in shot.white.items():
            white = quiet.view(raws[number], camera, record, geoms, lamps, mirrored).linear_rgb
            if surface in shot.grey:
                grey = quiet.view(shot.grey[surface][number], camera, record, geoms, lamps, mirrored).linear_rgb
                white = _unclipped(black, white, grey, shot.grey_weight)
            probe = crop_probe(surface, camera.name, black, white, pipeline.response)
            if probe is not None:
                probes.append(probe)
    return probes


def _unclipped(black: UInt16Image, white: UInt16Image, grey: UInt16Image, grey_weight: float) -> UInt16Image:
    """White without clipping; the rendered white where nothing is clipped."""
    computed = black + (grey.astype(np.float32) - black) / np.float32(grey_weight)
    return np.where(computed > white + np.float32(UNSURE), computed + np.float32(0.5), white).astype(np.uint16)
