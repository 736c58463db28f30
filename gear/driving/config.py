"""The config of `gear drive`: controllers, places, scenarios and patches."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from gear.config.collection import MOST_CROWDED, WeatherConfig
from gear.config.nodes import Mapping, Node, Place
from gear.contracts.tasks import NO_PATCH, RANDOM_PATCH
from gear.driving.dynamics import DynamicsName
from gear.driving.scenario import SPEEDS_KMH
from gear.values.errors import FieldError
from gear.values.serial import PLACES

LABEL = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")
NAMES = re.compile(r"\{(town|scene|model)\}")
"""Names in braces that a patch may contain; they stand for town, scene and network."""

PATCH = "patch"
"""Name of the twin that shows the patch of the driver."""

TWINS = (NO_PATCH, RANDOM_PATCH, PATCH)


def _nothing() -> Node:
    return Mapping({}, Place("defaults"))


@dataclass(frozen=True, slots=True, kw_only=True)
class Driver:
    """One driver: a controller, with the network and the defense through which it sees.

    Attributes:
        controller: name of the controller plugin.
        set: options of the controller.
        task: task whose cameras and predictions are used; empty for the first task that the controller reads.
        options: options of the task, such as the size of the pictures.
        model: name of the network; empty for a controller without a network.
        model_set: options of the network, such as `weights`.
        defense: name of a defense in front of the network; empty for none.
        defense_set: options of the defense.
        calibration, calibration_patched: datasets on which the defense is calibrated, without and with patches; empty
            for none.
        patch: the patch of the twin `patch`: a picture, a patch folder, or the name of an installed patch. `{town}`,
            `{scene}` and `{model}` stand for the names of town, scene and network. Empty for no such twin.
        places: file, line and column of each given value, by key.
    """

    controller: str
    set: Node = field(default_factory=_nothing)
    task: str = ""
    options: Node = field(default_factory=_nothing)
    model: str = ""
    model_set: Node = field(default_factory=_nothing)
    defense: str = ""
    defense_set: Node = field(default_factory=_nothing)
    calibration: str = ""
    calibration_patched: str = ""
    patch: str = ""
    places: dict[str, Place] = field(default_factory=dict, compare=False, repr=False, metadata=PLACES)

    def __post_init__(self) -> None:
        if self.defense and not self.model:
            raise FieldError("defense", "protects a network, and the driver has none; name one with `model`")
        if self.patch and not (self.model or self.task):
            raise FieldError("patch", "has no effect: the driver has no network and no cameras (`model`, `task`)")
        if set("{}") & set(NAMES.sub("", self.patch)):
            raise FieldError("patch", f"may contain {{town}}, {{scene}} and {{model}}, no other braces: {self.patch!r}")


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveConfig:
    """The config of a study in the closed loop.

    Attributes:
        drivers: drivers by name.
        towns: names of scenes, by town.
        scenarios: speeds of the ego car in km/h, by name of the scenario; an empty list means the speeds of the
            library. Empty for all scenarios of the library; those with a red light are then left out for controllers
            that read a task but no lights.
        library: name or path of the library of scenarios.
        twins: `none`, `random` and `patch`; drivers without cameras drive only `none`.
        repeats: number of drives of each driver, place, scenario, speed and twin, with different seeds.
        seed: seed of the first drive.
        weather: a weather preset, or a preset and the parameters that differ from it.
        crowd: factor on the scene's numbers of other vehicles and people, 0 to 10.
        dynamics: model of the ego car's motion: `kinematic` for the bicycle, `mujoco` for a car with four wheels and a
            suspension.
        video: whether each drive with cameras leaves a video (MP4), which needs the extra `video`.
        open_loop: whether the predictions of each drive are also evaluated by the metrics of their task, against the
            ground truth of the very same frames.
        collect: further settings of the pictures, such as `quality`; the keys are those of `gear show-config`.
        places: file, line and column of each given value, by key.
    """

    drivers: dict[str, Driver]
    towns: dict[str, tuple[str, ...]]
    scenarios: dict[str, tuple[float, ...]] = field(default_factory=dict)
    library: str = "standard"
    twins: tuple[str, ...] = TWINS
    repeats: int = 1
    seed: int = 0
    weather: WeatherConfig = field(default_factory=WeatherConfig)
    crowd: float = 0.5
    dynamics: DynamicsName = "kinematic"
    video: bool = False
    open_loop: bool = False
    collect: Node = field(default_factory=_nothing)
    places: dict[str, Place] = field(default_factory=dict, compare=False, repr=False, metadata=PLACES)

    def __post_init__(self) -> None:
        for name, what in (("drivers", "driver"), ("towns", "town"), ("twins", "twin")):
            if not getattr(self, name):
                raise FieldError(name, f"names no {what}")
        for label in self.drivers:
            if not LABEL.fullmatch(label):
                raise FieldError("drivers", f"{label!r} names folders and rows: letters, digits, `_`, `.` and `-`")
        for town, scenes in self.towns.items():
            if not scenes:
                raise FieldError("towns", f"{town} names no scene")
        low, high = SPEEDS_KMH
        for name, speeds_kmh in self.scenarios.items():
            for speed_kmh in speeds_kmh:
                if not low <= speed_kmh <= high:
                    raise FieldError(f"scenarios.{name}", f"must be {low:g} to {high:g} km/h, got {speed_kmh:g}")
        for twin in self.twins:
            if twin not in TWINS:
                raise FieldError("twins", f"must be among {', '.join(TWINS)}, got {twin!r}")
        if not 1 <= self.repeats <= 10_000:
            raise FieldError("repeats", f"must be 1 to 10000, got {self.repeats}")
        if self.seed < 0:
            raise FieldError("seed", f"must not be negative, got {self.seed}")
        if not 0 <= self.crowd <= MOST_CROWDED:
            raise FieldError("crowd", f"must be 0 to {MOST_CROWDED:g}, got {self.crowd:g}")
