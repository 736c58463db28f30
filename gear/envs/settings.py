"""The settings of a driving environment, and what an episode draws from them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from gear.config.collection import RendererName
from gear.contracts.rendering import Quality
from gear.driving.dynamics import DynamicsName
from gear.driving.scenario import SPEEDS_KMH, Scenario, load_scenarios
from gear.driving.start import Draw
from gear.values.errors import FieldError, GearError, UnknownNameError

PER_EPISODE = ("scene", "patch", "scenario", "speed_kmh")
"""Settings that `reset(options=...)` may change for one episode."""

MOST_SEED = 2**31


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveSettings:
    """The settings of `DriveEnv`.

    Attributes:
        town: name of a town, or path of its MJCF.
        scenes: name of a scene library, or path of its YAML; empty for the town's own.
        scene: name of a scene.
        patch: `none`, `random`, a picture, a patch folder, or the name of an installed patch; it needs a camera.
        weather: name of a weather preset.
        scenarios: name of a scenario library, or path of its YAML.
        scenario: name of a scenario; empty to draw one of the library in each episode, without those that have a red
            light.
        speed_kmh: speed of the ego car at the start, and its desired speed; 0 to draw one of the scenario's.
        dynamics: model of the ego car's motion: `kinematic` for the bicycle, `mujoco` for a car with four wheels and a
            suspension.
        obstacles: number of the nearest road users whose true positions are observed; 0 for none.
        width_px, height_px: size of the camera's picture; 0 for an environment without camera, which renders nothing.
        renderer, quality: renderer of the pictures.
    """

    town: str = "town10"
    scenes: str = ""
    scene: str = "no_billboard"
    patch: str = "none"
    weather: str = "ClearNoon"
    scenarios: str = "standard"
    scenario: str = ""
    speed_kmh: float = 0.0
    dynamics: DynamicsName = "kinematic"
    obstacles: int = 8
    width_px: int = 0
    height_px: int = 0
    renderer: RendererName = "raster"
    quality: Quality = "fast"

    def __post_init__(self) -> None:
        if not 0 <= self.obstacles <= 100:
            raise FieldError("obstacles", f"must be 0 to 100, got {self.obstacles}")
        if (self.width_px == 0) != (self.height_px == 0):
            raise FieldError("height_px", "a camera needs a width and a height; 0 and 0 is no camera")
        low, high = SPEEDS_KMH
        if self.speed_kmh and not low <= self.speed_kmh <= high:
            raise FieldError("speed_kmh", f"must be 0, or {low:g} to {high:g}, got {self.speed_kmh:g}")
        if self.dynamics not in get_args(DynamicsName):
            raise FieldError("dynamics", f"must be {' or '.join(get_args(DynamicsName))}, got {self.dynamics!r}")
        if self.patch != "none" and not self.has_camera:
            raise FieldError("patch", "a patch needs a camera that sees it; give width_px and height_px")

    @property
    def has_camera(self) -> bool:
        """Whether the environment renders pictures."""
        return self.width_px > 0

    def for_episode(self, options: Mapping[str, Any] | None) -> DriveSettings:
        """The settings of one episode: these settings with the options of `reset`.

        Args:
            options: options of `reset` by name; None for none.

        Raises:
            UnknownNameError: an option is unknown.
            GearError: an option has an impossible value.
        """
        for name in options or {}:
            if name not in PER_EPISODE:
                raise UnknownNameError("option of reset", name, PER_EPISODE)
        return settings_of({**dataclasses.asdict(self), **(options or {})})

    def draws(self, rng: np.random.Generator) -> Iterator[Draw]:
        """The starts that an episode may have, in a random order; the first for which the scene has a place is taken.

        Args:
            rng: random generator of the episode; it decides the seed of the drive and the order.

        Raises:
            UnknownNameError: the library has no such scenario.
        """
        scenarios = load_scenarios(self.scenarios).scenarios
        if self.scenario and self.scenario not in scenarios:
            raise UnknownNameError("scenario", self.scenario, scenarios)
        drawn = [name for name, one in scenarios.items() if not one.red_light]  # the numbers show no light
        names = [self.scenario] if self.scenario else drawn
        pairs = [(name, speed_kmh) for name in names for speed_kmh in self._speeds_kmh(scenarios[name])]
        seed = int(rng.integers(MOST_SEED))
        for number in rng.permutation(len(pairs)):
            name, speed_kmh = pairs[number]
            yield Draw(name=name, scenario=scenarios[name], speed_mps=speed_kmh / 3.6, seed=seed)

    def _speeds_kmh(self, scenario: Scenario) -> tuple[float, ...]:
        return (self.speed_kmh,) if self.speed_kmh else scenario.speeds_kmh


def settings_of(values: Mapping[str, Any]) -> DriveSettings:
    """Makes settings from values by name.

    Args:
        values: values by name of the field of `DriveSettings`; missing fields take their defaults.

    Raises:
        UnknownNameError: a name is no setting.
        GearError: a value is impossible.
    """
    known = [field.name for field in dataclasses.fields(DriveSettings)]
    for name in values:
        if name not in known:
            raise UnknownNameError("setting of the environment", name, known)
    try:
        return DriveSettings(**values)
    except FieldError as error:
        raise GearError(f"environment: {error}") from error
