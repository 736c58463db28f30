"""The contract of controllers (what every controller plugin promises), as tests.

Subclass it in your plugin's tests and set `spec`:

    class TestMyController(ControllerContract):
        spec = my_controller

Observations come from `gear.testing.synthetic`, so no renderer is needed: a perfect network drives through a street.
For tasks other than gear's own, override `predictions`.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from gear.contracts.controllers import Action, CarFacts, EgoState, Observation, Obstacle
from gear.contracts.specs import ControllerSpec, TaskSpec
from gear.plugins.manager import catalogue
from gear.testing.compare import difference, freeze
from gear.testing.spec_checks import check_spec
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import Thing
from gear.values.rig import CameraMount, Rig

FRAMES, INTERVAL_S, SPEED_MPS = 6, 0.1, 10.0

CAR = CarFacts(
    wheelbase_m=2.7,
    front_m=2.3,
    rear_m=2.3,
    half_width_m=0.95,
    most_acceleration_mps2=3.0,
    most_braking_mps2=8.0,
    most_steering_rad=0.6,
)
"""The car of all observations."""

CAMERA = Rig(cameras=(CameraMount(name="left", width_px=320, height_px=160),))
"""The rig of controllers that read no task."""


def straight_road(
    prediction: Any = None,
    *,
    time_s: float = 0.0,
    speed_mps: float = SPEED_MPS,
    rig: Rig = CAMERA,
    views: Mapping[str, Any] | None = None,
    obstacles: Sequence[Obstacle] = (),
) -> Observation:
    """An observation on a straight road of 80 m, in the middle of a lane of 3.5 m, at the desired speed of 10 m/s.

    Args:
        prediction: the network's prediction.
        time_s: time of the frame.
        speed_mps: speed of the ego car.
        rig: the cameras.
        views: pictures by camera name.
        obstacles: true positions of other road users.
    """
    return Observation(
        time_s=time_s,
        ego=EgoState(speed_mps=speed_mps),
        car=CAR,
        cruise_mps=SPEED_MPS,
        path_m=np.column_stack([np.arange(0.0, 81.0), np.zeros(81)]),
        lane_width_m=3.5,
        cameras=rig.cameras,
        prediction=prediction,
        views=dict(views or {}),
        obstacles=tuple(obstacles),
    )


def obstacles_of(things: Sequence[Thing]) -> tuple[Obstacle, ...]:
    """The standing obstacles of a controller with truth, from objects of a synthetic street.

    Args:
        things: objects of the street. Those without an id, and countable objects of the town, are left out.
    """
    return tuple(
        Obstacle(
            id=thing.object_id,
            kind="person" if thing.role == "pedestrian" else "vehicle",
            ahead_m=thing.position_m[0],
            left_m=thing.position_m[1],
            yaw_rad=thing.yaw_rad,
            half_length_m=max(part.size_m[0] for part in thing.parts) / 2,
            half_width_m=max(part.size_m[1] for part in thing.parts) / 2,
            velocity_mps=(0.0, 0.0),
        )
        for thing in things
        if 0 <= thing.object_id < 1000
    )


class ControllerContract:
    """The promises of a controller plugin, as tests.

    Attributes:
        spec: the controller's spec.
        options: options of the controller's config.
        task_options: options of the tasks' configs, such as a size of pictures that is small enough for quick tests.
    """

    spec: ClassVar[ControllerSpec[Any]]
    options: ClassVar[Mapping[str, Any]] = {}
    task_options: ClassVar[Mapping[str, Any]] = {"width_px": 256, "height_px": 128}

    def make(self) -> Any:
        """A new controller."""
        return self.spec.build(self.spec.config(**self.options))

    def observations(self, task: str | None) -> list[Observation]:
        """The frames of a short drive, all arrays read-only; `task` is None for a controller without a network.

        Args:
            task: name of the task whose perfect predictions the observations contain.
        """
        rig, builder = CAMERA, None
        if task is not None:
            found = catalogue().get("task", task).spec
            assert isinstance(found, TaskSpec)
            builder = found.build(found.config(**self.task_options))
            rig = builder.rig()
        frames = []
        for number in range(FRAMES):
            frame, record = synthetic_frame(rig, index=number // 3, seed=7)
            prediction = None if builder is None else builder.as_prediction(builder.ground_truth(frame, record))
            views = {name: _grey(view) for name, view in frame.views.items()} if self.spec.needs_views else {}
            frames.append(straight_road(prediction, time_s=number * INTERVAL_S, rig=rig, views=views))
        return [freeze(frame) for frame in frames]

    def drive(self, task: str | None, controller: Any = None, seed: int = 3) -> list[Action]:
        """The actions of a controller over one drive.

        Args:
            task: task whose pictures the controller gets; None for no pictures.
            controller: the controller; None builds a new one.
            seed: seed of the drive.
        """
        controller = controller or self.make()
        controller.reset(seed)
        return [controller.act(observation) for observation in self.observations(task)]

    @property
    def tasks(self) -> tuple[str | None, ...]:
        """The tasks that the controller reads; (None,) for a controller without a network."""
        return self.spec.tasks or (None,)

    def test_the_spec_can_be_used(self) -> None:
        """Name, summary, protocol, config and tasks of the spec are valid."""
        check_spec("controller", self.spec, self.options)
        known = catalogue().names("task")
        assert all(task in known for task in self.spec.tasks), f"its tasks must be among {', '.join(known)}"

    def test_actions_are_finite_numbers(self) -> None:
        """Acceleration, steering and notes are finite numbers."""
        for task in self.tasks:
            for action in self.drive(task):
                numbers = {"acceleration": action.acceleration_mps2, "steering": action.steering_rad, **action.notes}
                assert all(isinstance(name, str) for name in action.notes)
                assert all(math.isfinite(float(value)) for value in numbers.values()), numbers

    def test_a_drive_repeats(self) -> None:
        """The same seed and the same frames give the same actions, in a new controller and after a reset."""
        for task in self.tasks:
            controller = self.make()
            first = self.drive(task, controller)
            assert not difference(first, self.drive(task, controller)), "reset must forget the earlier drive"
            assert not difference(first, self.drive(task))

    def test_observations_are_left_alone(self) -> None:
        """`act` does not change what it receives."""
        for task in self.tasks:
            observations = self.observations(task)
            before = copy.deepcopy(observations)
            controller = self.make()
            controller.reset(3)
            for observation in observations:
                controller.act(observation)
            assert not difference(observations, before)

    def test_any_speed_is_driven(self) -> None:
        """A standing and a very fast car, and a path of only two points, raise no error."""
        for task in self.tasks:
            observation = self.observations(task)[0]
            for speed_mps in (0.0, 40.0):
                controller = self.make()
                controller.reset(0)
                short = straight_road(
                    observation.prediction,
                    speed_mps=speed_mps,
                    rig=Rig(cameras=observation.cameras),
                    views=observation.views,
                )
                action = controller.act(short)
                assert math.isfinite(action.acceleration_mps2) and math.isfinite(action.steering_rad)


def _grey(view: Any) -> Any:
    """A (H, W, 3) uint8 picture of a synthetic view."""
    return np.ascontiguousarray(view.rgb, np.uint8)
