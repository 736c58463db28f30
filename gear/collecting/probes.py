"""Probes while collecting: the placed scene once more with black and with white surfaces.

A white surface that a low sun shines on full in the face is brighter than full scale, and a frame ends there: what it
says of white says too little of every patch. Such a surface is seen in grey as well, and white worked out from that.
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
"""One a camera."""

UNSURE = 8
"""Steps of a frame by which white that was worked out may miss white that was seen, for rounding alone."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ProbeShot:
    """What the renderer saw.

    Attributes:
        black: with all surfaces black.
        white: by surface, with that one white and the others black.
        grey: by surface, the same in grey, of those whose white reaches full scale.
        grey_weight: what that grey weighs beside white.
    """

    black: Raws
    white: Mapping[str, Raws]
    grey: Mapping[str, Raws]
    grey_weight: float


def shoot_probes(world: World, renderer: Renderer, placed: PlacedStage, record: SceneRecord, shapes: Raws) -> ProbeShot:
    """Renders what was placed last, once with all surfaces black and once a surface with it white.

    Args:
        world: that it was placed in.
        renderer: of that world.
        placed: the sample.
        record: who looks, and at which surfaces.
        shapes: the views of the sample itself, whose depth and ids are the same.
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
    """Probes of all surfaces and cameras.

    Args:
        pipeline: the camera pipeline of the sample; its noise is left out.
        shot: the probe renders.
        record: the scene.
        geoms: what each geom is.
        reflections: what wet ground mirrors in the sample itself, one per camera.
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
    """White as it would be without an end of the scale; as it was seen, where that is all the same."""
    reckoned = black + (grey.astype(np.float32) - black) / np.float32(grey_weight)
    return np.where(reckoned > white + np.float32(UNSURE), reckoned + np.float32(0.5), white).astype(np.uint16)
