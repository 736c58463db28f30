"""The loop with controllers that return wrong things, and with a camera."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from gear.contracts.controllers import Action, Observation
from gear.contracts.specs import ControllerSpec
from gear.driving.loop import Sight, Wheel, drive
from gear.driving.scenario import Scenario
from gear.driving.simulation import DriveSimulation, Situation
from gear.driving.start import Draw
from gear.plugins.catalogue import Owner, PluginEntry
from gear.plugins.controllers.baseline import BaselineConfig
from gear.plugins.manager import catalogue
from gear.testing.synthetic import synthetic_frame
from gear.testing.tiny_town import tiny_world
from gear.values.errors import PluginError

SHORT = Draw(name="free_road", scenario=Scenario(duration_s=1.0), speed_mps=8.0, seed=1)


class Foreign:
    """A controller of another package that returns what it was given."""

    def __init__(self, answer: Any) -> None:
        self.answer, self.seeds, self.seen = answer, [], []  # type: ignore[var-annotated]

    def reset(self, seed: int) -> None:
        self.seeds.append(seed)

    def act(self, observation: Observation) -> Any:
        self.seen.append(observation)
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer


def wheel(controller: Foreign, *, needs_truth: bool = False) -> Wheel:
    spec = ControllerSpec(
        name="foreign", summary="foreign", config=BaselineConfig, build=lambda _: controller, needs_truth=needs_truth
    )
    owner = Owner(plugin="foreign", package="other", version="1.0")
    return Wheel(plugin=PluginEntry(kind="controller", spec=spec, owner=owner), controller=controller)


@pytest.fixture(scope="module")
def simulation() -> DriveSimulation:
    world = tiny_world()
    return DriveSimulation(world, world.scene)


def test_the_log_has_the_tilt_of_a_car_with_a_body() -> None:
    world = tiny_world()
    brake = wheel(Foreign(Action(acceleration_mps2=-8.0, steering_rad=0.0)))
    log = drive(DriveSimulation(world, world.scene, "mujoco"), SHORT, brake)
    assert log[0]["dynamics"] == "mujoco"
    pitch_rad, roll_rad = log[9]["tilt"]
    assert pitch_rad > 0.015 and abs(roll_rad) < 0.005, "the nose dives"


def test_a_controller_receives_what_its_spec_asks_for(simulation: DriveSimulation) -> None:
    straight = Foreign(Action(acceleration_mps2=0.0, steering_rad=0.0, notes={"gap_m": 3.0}))
    watched: list[Situation] = []
    log = drive(simulation, SHORT, wheel(straight), watch=lambda now, *_: watched.append(now))
    assert straight.seeds == [1] and len(straight.seen) == len(watched) - 1 == 10
    assert all(not one.obstacles and not one.views and one.prediction is None for one in straight.seen)
    assert len(log) == 1 + 11 + 1 and log[1]["notes"] == {"gap_m": 3.0} and log[-1]["ending"] == "time"
    assert "dynamics" not in log[0] and "tilt" not in log[1]
    knowing = Foreign(straight.answer)
    drive(simulation, SHORT, wheel(knowing, needs_truth=True))
    assert knowing.seen[0].obstacles


@pytest.mark.parametrize(
    ("answer", "problem"),
    [
        (None, "returned NoneType, not an Action"),
        (Action(acceleration_mps2=math.nan, steering_rad=0.0), "not finite"),
        (Action(acceleration_mps2=0.0, steering_rad=0.0, notes={"x": math.inf}), "not finite"),
        (ZeroDivisionError("oops"), "oops"),
    ],
)
def test_faults_of_other_packages_name_the_package(simulation: DriveSimulation, answer: Any, problem: str) -> None:
    with pytest.raises(PluginError, match=r"foreign \(other 1.0\) failed at act in frame 0") as caught:
        drive(simulation, SHORT, wheel(Foreign(answer)))
    assert problem in str(caught.value)


def test_predictions_are_evaluated_at_the_very_same_frames(simulation: DriveSimulation) -> None:
    """A perfect network on a synthetic street has no error, and the controller receives its predictions."""
    found = catalogue().get("task", "depth")
    task: Any = found.spec.build(found.spec.config(width_px=128, height_px=64))
    frame, record = synthetic_frame(task.rig())
    truth = task.as_prediction(task.ground_truth(frame, record))
    session: Any = SimpleNamespace(
        pipeline=SimpleNamespace(with_effects=lambda shown: shown),
        shoot=lambda shown: shown,
        to_frame=lambda _: frame,
        task=task,
        plugin=found,
        job=SimpleNamespace(patch=SimpleNamespace(digest="ab12")),
    )
    model: Any = SimpleNamespace(predict=lambda views, numbers: [SimpleNamespace(prediction=truth)])
    sight = Sight(session=session, rig=task.rig(), model=model, evaluator=task.evaluator())
    controller = Foreign(Action(acceleration_mps2=0.0, steering_rad=0.0))
    log = drive(simulation, SHORT, wheel(controller), sight)
    assert log[0]["patch_sha256"] == "ab12"
    assert all(one.prediction is truth and one.cameras == task.rig().cameras for one in controller.seen)
    assert sight.evaluator is not None and sight.evaluator.result()["rmse_m"] == pytest.approx(0.0, abs=1e-6)
