"""One drive from its start to its end: picture, network, controller, car, traffic, ten times per second."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gear.collecting.session import Session
from gear.contracts.controllers import Action, Controller
from gear.contracts.specs import ControllerSpec
from gear.contracts.tasks import Evaluator
from gear.driving.log import danger_of, frame_entry
from gear.driving.simulation import DriveSimulation, Situation
from gear.driving.start import Draw
from gear.measuring.guarded_model import GuardedModel
from gear.plugins.build import blamed
from gear.plugins.catalogue import PluginEntry
from gear.values.errors import PluginError
from gear.values.frames import Frame, UInt8Image
from gear.values.rig import Rig
from gear.values.scene import SceneRecord
from gear.values.serial import Json, to_json

FORMAT = 1
"""Version of the log's format."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Sight:
    """What a driver with cameras sees: the pictures of a frame, and what the network predicts from them.

    Attributes:
        session: world, renderer and camera of the place, with the patch of the twin.
        rig: the cameras.
        model: the network with its defense; None for a controller that looks at the pictures itself.
        evaluator: evaluator of the task, which gathers the predictions of all frames; None if they are not evaluated.
    """

    session: Session
    rig: Rig
    model: GuardedModel | None
    evaluator: Evaluator[Any, Any] | None = None

    def look(self, simulation: DriveSimulation, frame: int) -> tuple[Mapping[str, UInt8Image], Any]:
        """Renders the current state and predicts from the pictures.

        If there are a model and an evaluator, the evaluator is updated with the frame.

        Args:
            simulation: the drive whose current state is rendered.
            frame: number of the frame, from 0; the index of the scene record.

        Returns:
            (H, W, 3) uint8 pictures by camera, and the prediction; the prediction is None without a model.
        """
        record, shown = self._shot(simulation, frame)
        views = {name: view.rgb for name, view in shown.views.items()}
        if self.model is None:
            return views, None
        prediction = self.model.predict([views], [frame])[0].prediction
        if self.evaluator is not None:
            with blamed(self.session.plugin, f"frame {frame}"):
                self.evaluator.update(self.session.task.ground_truth(shown, record), prediction)
        return views, prediction

    def pictures(self, simulation: DriveSimulation, frame: int) -> Mapping[str, UInt8Image]:
        """Renders the current state for the video: (H, W, 3) uint8 pictures by camera; nothing is predicted.

        Args:
            simulation: the drive whose current state is rendered.
            frame: number of the frame, from 0.
        """
        return {name: view.rgb for name, view in self._shot(simulation, frame)[1].views.items()}

    def _shot(self, simulation: DriveSimulation, frame: int) -> tuple[SceneRecord, Frame]:
        record = self.session.pipeline.with_effects(simulation.record(self.rig, frame))
        return record, self.session.to_frame(self.session.shoot(record))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Wheel:
    """A built controller, and the plugin that it comes from.

    Attributes:
        plugin: plugin of the controller, for error messages.
        controller: the controller.
    """

    plugin: PluginEntry
    controller: Controller

    @property
    def spec(self) -> ControllerSpec[Any]:
        """The controller's spec."""
        spec = self.plugin.spec
        assert isinstance(spec, ControllerSpec)
        return spec

    def decide(self, situation: Situation, sight: Sight | None, views: Mapping[str, UInt8Image], seen: Any) -> Action:
        """The controller's action in one frame.

        Args:
            situation: the state of the drive at the time of the frame.
            sight: cameras and network of the driver; None for a controller without cameras.
            views: (H, W, 3) uint8 pictures by camera; the controller gets them only if its spec has `needs_views`.
            seen: prediction of the network for the pictures; None without a network.

        Raises:
            PluginError: a controller of another package failed, or returned something else than finite numbers.
        """
        spec = self.spec
        observation = situation.observation(
            cameras=() if sight is None else sight.rig.cameras,
            prediction=seen,
            views=views if spec.needs_views else None,
            with_truth=spec.needs_truth,
        )
        stage = f"act in frame {situation.frame}"
        with blamed(self.plugin, stage):
            action = self.controller.act(observation)
        if not isinstance(action, Action):
            raise self._problem(stage, f"returned {type(action).__name__}, not an Action")
        numbers = [action.acceleration_mps2, action.steering_rad, *action.notes.values()]
        if not np.isfinite(np.array(numbers, np.float64)).all():
            raise self._problem(stage, "returned a number that is not finite")
        return action

    def _problem(self, stage: str, problem: str) -> PluginError:
        owner = self.plugin.owner
        return PluginError(f"{self.spec.name} ({owner.package} {owner.version})", stage, problem)


Watch = Callable[[Situation, Mapping[str, UInt8Image], Any, Action | None], None]
"""Type of a function that is called in every frame with the state, the pictures, the prediction and the action, and
once more at the end of the drive, where prediction and action are None.
"""


def drive(
    simulation: DriveSimulation, draw: Draw, wheel: Wheel, sight: Sight | None = None, watch: Watch | None = None
) -> list[Json]:
    """Drives from the start to the end.

    Args:
        simulation: the place.
        draw: the scenario, the speed and the seed.
        wheel: the controller.
        sight: cameras and network; None for a controller without cameras, for which nothing is rendered.
        watch: called in every frame and at the end of the drive (`Watch`); None for nothing.

    Returns:
        The log: a head with the scenario, the car, the assets of the road users, the dynamics if they are not
        kinematic, and with cameras the hash of the patch's pictures ("" without a patch); one entry per frame
        (`frame_entry`); and an end with `ending` and `crash`.

    Raises:
        PlacementError: the place has no room for the scenario.
        PluginError: code of another package failed.
    """
    situation = simulation.reset(draw)
    with blamed(wheel.plugin, "reset"):
        wheel.controller.reset(draw.seed)
    ids, scripted = simulation.ids, simulation.scripted_id
    has_body = simulation.dynamics != "kinematic"
    log: list[Json] = [
        {
            "format": FORMAT,
            "scenario": to_json(draw),
            "car": to_json(situation.car),
            "start_s_m": simulation.start.s_m,
            "conflict_s_m": _finite(simulation.start.conflict_s_m),
            "scripted_id": scripted,
            "actors": {str(ids[body]): name for body, name in simulation.assets.items()},
            **({"dynamics": simulation.dynamics} if has_body else {}),
            **({} if sight is None else {"patch_sha256": sight.session.job.patch.digest}),
        }
    ]
    while not situation.is_over:
        views, seen = ({}, None) if sight is None else sight.look(simulation, situation.frame)
        action = wheel.decide(situation, sight, views, seen)
        log.append(frame_entry(situation, danger_of(situation, scripted), action, ids, with_tilt=has_body))
        if watch is not None:
            watch(situation, views, seen, action)
        situation = simulation.step(action)
    log.append(frame_entry(situation, danger_of(situation, scripted), None, ids, with_tilt=has_body))
    if watch is not None:
        watch(situation, {} if sight is None else sight.pictures(simulation, situation.frame), None, None)
    log.append({"ending": situation.ending, "crash": None if situation.crash is None else to_json(situation.crash)})
    return log


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
