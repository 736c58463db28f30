"""What a driving environment holds while it stays in one scene: the compiled world, and the renderer of its camera."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, replace

from gear.collecting.job import resolve
from gear.collecting.lookup import look_up
from gear.collecting.patch_sources import resolve_patch
from gear.collecting.session import Session, open_session
from gear.config.collection import CollectionConfig
from gear.config.load import load_collection
from gear.driving.simulation import DriveSimulation
from gear.envs.settings import DriveSettings
from gear.values.frames import UInt8Image
from gear.world.compilation.world_cache import load_or_compile

TASK = "depth"
"""Task whose camera the environment has; of its ground truth nothing is computed."""


@dataclass(slots=True, eq=False, kw_only=True)
class DriveStage:
    """A scene in which drives take place, and the camera that watches them.

    Attributes:
        scene: name of the scene.
        simulation: drives in the scene.
        session: renderer and camera; None without a camera.
    """

    scene: str
    simulation: DriveSimulation
    session: Session | None
    _patch: str
    _opened: ExitStack

    @staticmethod
    def open(settings: DriveSettings) -> DriveStage:
        """Compiles the world of a scene and, for a camera, opens a renderer.

        Args:
            settings: settings of the environment, which name the scene and the camera. `DriveStage.close` closes the
                renderer.

        Raises:
            GearError: a name is unknown, a file cannot be read, or the renderer cannot start.
        """
        opened = ExitStack()
        config = _config(settings)
        if settings.has_camera:
            job = resolve(config)
            session = opened.enter_context(open_session(job))
            simulation = DriveSimulation(session.world, job.scene, settings.dynamics)
            return DriveStage(
                scene=settings.scene, simulation=simulation, session=session, _patch=settings.patch, _opened=opened
            )
        named = look_up(config)
        world = load_or_compile(town=config.town, scene_name=config.scene, scene=named.scene, weather=named.weather)
        simulation = DriveSimulation(world, named.scene, settings.dynamics)
        return DriveStage(scene=settings.scene, simulation=simulation, session=None, _patch="none", _opened=opened)

    def show_patch(self, patch: str) -> None:
        """Shows another patch on the surfaces of the scene, from the next picture on.

        Args:
            patch: `none`, `random`, a picture, a patch folder, or the name of an installed patch.

        Raises:
            PatchError: the patch cannot be read, or does not fit the scene.
        """
        if self.session is None or patch == self._patch:
            return
        job = self.session.job
        found = resolve_patch(patch, surfaces=len(self.session.world.faces), seed=job.config.patch_seed)
        self.session, self._patch = replace(self.session, job=replace(job, patch=found)), patch

    def picture(self) -> UInt8Image | None:
        """The (H, W, 3) uint8 picture of the camera in the current situation; None without a camera."""
        if self.session is None:
            return None
        session = self.session
        record = self.simulation.record(session.task.rig(), self.simulation.situation.frame)
        frame = session.to_frame(session.shoot(session.pipeline.with_effects(record)))
        return next(iter(frame.views.values())).rgb

    def close(self) -> None:
        """Closes the renderer."""
        self._opened.close()


def _config(settings: DriveSettings) -> CollectionConfig:
    """The collection config with the scene, the weather, the patch and the camera of the settings."""
    flags: dict[str, str | None] = {
        "task": TASK, "town": settings.town, "scene": settings.scene, "patch": settings.patch,
        "weather": settings.weather, "renderer": settings.renderer, "quality": settings.quality,
        "scenes": settings.scenes or None,
    }  # fmt: skip
    sizes = {"options.width_px": settings.width_px, "options.height_px": settings.height_px}
    return load_collection(None, flags, [f"{key}={value}" for key, value in sizes.items() if value])
