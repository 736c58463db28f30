"""Probes while collecting: the placed scene once more with black and with white surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from gear.camera.develop import Darkroom
from gear.contracts.rendering import RawView, Renderer
from gear.formats.probes import Probe, crop_probe
from gear.values.frames import GeomTable
from gear.values.scene import SceneRecord
from gear.world.world import PlacedStage, World

Raws = tuple[RawView, ...]
"""Colour alone, one a camera."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ProbeShot:
    """What the renderer saw.

    Attributes:
        black: with all surfaces black.
        white: by surface, with that one white and the others black.
    """

    black: Raws
    white: Mapping[str, Raws]


def shoot_probes(world: World, renderer: Renderer, placed: PlacedStage, record: SceneRecord) -> ProbeShot:
    """Renders what was placed last, once with all surfaces black and once a surface with it white."""
    names = [surface.name for surface in record.surfaces]

    def seen(white: str | None) -> Raws:
        stage = world.redressed(placed, {name: "white" if name == white else "black" for name in names})
        return renderer.render(stage, record.cameras, truth=False)

    return ProbeShot(black=seen(None) if names else (), white={name: seen(name) for name in names})


def develop_probes(
    darkroom: Darkroom, shot: ProbeShot, truth: Raws, record: SceneRecord, geoms: GeomTable
) -> list[Probe]:
    """Crops of developed frames; `truth` holds the views of the sample itself, whose depth and ids are the same."""
    quiet = replace(darkroom, effects=replace(darkroom.effects, shot_noise=0.0, read_noise=0.0))
    probes = []
    for number, camera in enumerate(record.cameras):

        def developed(raws: Raws, number: int = number) -> RawView:
            return replace(truth[number], linear_rgb=raws[number].linear_rgb)

        if not shot.white:
            break
        lamps = quiet.night_light(truth[number], camera, record, geoms)
        black = quiet.view(developed(shot.black), camera, record, geoms, lamps).linear_rgb
        for surface, raws in shot.white.items():
            white = quiet.view(developed(raws), camera, record, geoms, lamps).linear_rgb
            probe = crop_probe(surface, camera.name, black, white, darkroom.response)
            if probe is not None:
                probes.append(probe)
    return probes
