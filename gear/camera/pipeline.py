"""The camera pipeline: lamps, contact shadows, water, air, rain, camera effects and response, in this order."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gear.camera.air import Air
from gear.camera.contact_shadows import ContactShadows
from gear.camera.effects import CameraEffects, Exposure
from gear.camera.night import Night, NightLight
from gear.camera.rain import Rain
from gear.camera.reflection import MirrorView, Reflection, beyond_mirror, mirror_camera
from gear.camera.response import Response
from gear.camera.water import Water
from gear.contracts.rendering import RawView
from gear.values.frames import GeomTable, UInt16Image, View
from gear.values.labels import GROUND_CODES, OPEN_GROUND_CODES
from gear.values.rng import derive_rng
from gear.values.scene import CameraRecord, SceneRecord


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CameraPipeline:
    """Turns the linear frames of one renderer into pictures of one weather.

    All steps except sensor noise and the tone curve are linear in every albedo.

    Attributes:
        response: exposure and tone curve.
        contact_shadows: darker ground under and beside road users; None for no contact shadows.
        night: the town's lamps; None by day.
        air: fog, haze and the veil of rain.
        water: puddles and wet ground.
        rain: streaks of falling drops.
        effects: parameters of the optional camera effects.
    """

    response: Response
    contact_shadows: ContactShadows | None = None
    night: Night | None = None
    air: Air
    water: Water
    rain: Rain
    effects: CameraEffects

    def with_effects(self, record: SceneRecord) -> SceneRecord:
        """Returns the scene record with cameras that also record the parameters of the active camera effects on
        which ground truth depends, such as the lens.

        Args:
            record: record of the scene with pinhole cameras; it is not changed.
        """
        cameras = record.cameras
        for effect in self.effects.active():
            cameras = tuple(effect.recorded(camera) for camera in cameras)
        return record if cameras == record.cameras else replace(record, cameras=cameras)

    def night_light(
        self, truth: RawView, camera: CameraRecord, record: SceneRecord, geoms: GeomTable
    ) -> NightLight | None:
        """Computes the light of lamps in a view, an argument of `CameraPipeline.view`; None by day.

        Args:
            truth: depth and ids of the view.
            camera: the camera of the view.
            record: the scene.
            geoms: label, object and surface of each geom.
        """
        return self.night.light(truth, camera, record, geoms) if self.night is not None else None

    def mirror_camera(self, camera: CameraRecord, record: SceneRecord) -> CameraRecord | None:
        """Returns the camera below the ground that renders the reflections on wet ground; None if the ground is
        dry or not in view.

        At night the result is also None: `NightLight` contains the reflections of lamps, and other reflections are too
        dark.

        Args:
            camera: the camera that takes the picture.
            record: the scene; the ego car's height is that of the ground.
        """
        if self.night is not None or (self.water.share <= 0 and self.water.film <= 0):
            return None
        return mirror_camera(camera, record.ego.world_from_actor.position_m[2])

    def reflection(self, below: MirrorView | None, record: SceneRecord) -> Reflection | None:
        """Makes the reflections on wet ground from a rendered view of the mirrored camera; None without such a
        view.

        Args:
            below: a render by `mirror_camera` in which the ground is left out and patch surfaces are neutral, and that
                camera; None for no reflections.
            record: the scene; the ego car's height is that of the ground.
        """
        if below is None:
            return None
        raw, camera = below
        assert raw.linear_rgb is not None
        height_m = record.ego.world_from_actor.position_m[2]
        # The air between the camera and the ground is applied to the whole frame, later.
        veiled = replace(raw, linear_rgb=self.air.apply(raw.linear_rgb, *beyond_mirror(raw.depth_m, camera, height_m)))
        return Reflection.of(veiled, camera, height_m)

    def view(
        self,
        raw: RawView,
        camera: CameraRecord,
        record: SceneRecord,
        geoms: GeomTable,
        night_light: NightLight | None = None,
        reflection: Reflection | None = None,
    ) -> View:
        """Returns the finished view of a camera: colour with weather and camera effects, and depth and ids aligned
        with the colour.

        Args:
            raw: linear colour, depth and ids from a renderer; not changed.
            camera: the camera that takes the picture.
            record: the scene, for its seed and the ego car's motion.
            geoms: label, object and surface of each geom.
            night_light: result of `CameraPipeline.night_light` for this view (it may be shared by renders with other
                patches); computed here if None.
            reflection: reflections on wet ground; if None, puddles reflect only the sky.
        """
        seen = replace(raw, linear_rgb=self._weathered(raw, camera, record, geoms, night_light, reflection))
        exposure = Exposure(camera=camera, scene=record, geoms=geoms)
        for effect in self.effects.active():
            seen = effect.apply(seen, exposure)
        assert seen.linear_rgb is not None
        return View(
            camera=camera,
            linear_rgb=seen.linear_rgb,
            rgb=self.response.apply(seen.linear_rgb),
            depth_m=seen.depth_m,
            geom_id=seen.geom_id,
        )

    def _weathered(
        self,
        raw: RawView,
        camera: CameraRecord,
        record: SceneRecord,
        geoms: GeomTable,
        given: NightLight | None,
        reflection: Reflection | None,
    ) -> UInt16Image:
        assert raw.linear_rgb is not None
        linear_rgb = raw.linear_rgb
        lamps = given or self.night_light(raw, camera, record, geoms)
        if lamps is not None:
            linear_rgb = lamps.apply(linear_rgb)
        if self.contact_shadows is not None:
            is_ground = np.append(np.isin(geoms.label_code, GROUND_CODES), False)
            linear_rgb = self.contact_shadows.apply(linear_rgb, raw.depth_m, is_ground[raw.geom_id], camera, record)
        if self.water.share > 0 or reflection is not None:
            # The appended entry is found by id -1 (no geom).
            holds_water = np.append(np.isin(geoms.label_code, OPEN_GROUND_CODES), False)
            linear_rgb = self.water.apply(linear_rgb, raw.depth_m, holds_water[raw.geom_id], camera, reflection)
        if lamps is not None:
            linear_rgb = lamps.apply_reflections(linear_rgb)
            del lamps  # frees much memory
        linear_rgb = self.air.apply(linear_rgb, raw.depth_m, camera)
        if self.rain.intensity > 0:
            rng = derive_rng(record.seed, "rain", record.index, camera.name)
            linear_rgb = self.rain.apply(linear_rgb, raw.depth_m, camera, record.ego.velocity_world_mps, rng)
        return linear_rgb
