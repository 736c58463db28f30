"""Scenarios of the closed loop, as they stand in YAML: what happens in front of the ego car, and at which speeds.

The scenarios that come with gear (`configs/scenarios/standard.yml`) follow Euro NCAP's protocols for emergency braking:
a car that stands (CCRs), a slower car (CCRm), a car that cuts in, and people who cross or stand (CPNA, CPLA).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from gear.config.load import find_config
from gear.config.nodes import Place, parse_file
from gear.config.reader import WHOLE, read_node
from gear.values.errors import FieldError
from gear.values.serial import PLACES

SPEEDS_KMH = (5.0, 130.0)
"""Smallest and largest speed of the ego car, km/h."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CutIn:
    """A change of lane in front of the ego car.

    Attributes:
        at_ttc_s: time to collision at which the other car begins to change into the ego car's lane, 0.5 to 10 s.
        takes_s: time that the change takes, 0.2 to 10 s.
    """

    at_ttc_s: float = 3.0
    takes_s: float = 1.2

    def __post_init__(self) -> None:
        if not 0.5 <= self.at_ttc_s <= 10:
            raise FieldError("at_ttc_s", f"must be 0.5 to 10 s, got {self.at_ttc_s:g}")
        if not 0.2 <= self.takes_s <= 10:
            raise FieldError("takes_s", f"must be 0.2 to 10 s, got {self.takes_s:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Lead:
    """A vehicle ahead of the ego car. In a scene with a patched truck, it is the truck.

    Attributes:
        speed_kmh: its speed in km/h; None for the speed that follows from `speed_share`.
        speed_share: its speed as a share of the ego car's, 0 to 1; 0 stands.
        cut_in: change from the neighbouring lane into the ego car's lane; None for a vehicle in the same lane.
    """

    speed_kmh: float | None = None
    speed_share: float = 0.0
    cut_in: CutIn | None = field(default=None, metadata=WHOLE)

    def __post_init__(self) -> None:
        if self.speed_kmh is not None and not 0 <= self.speed_kmh <= SPEEDS_KMH[1]:
            raise FieldError("speed_kmh", f"must be 0 to {SPEEDS_KMH[1]:g} km/h, got {self.speed_kmh:g}")
        if not 0 <= self.speed_share <= 1:
            raise FieldError("speed_share", f"is a share, 0 to 1, got {self.speed_share:g}")

    def speed_mps(self, ego_mps: float) -> float:
        """Speed of the vehicle ahead in m/s, as the scenario states it, but never above the speed of the ego car.

        Args:
            ego_mps: speed of the ego car, m/s.
        """
        wanted_mps = self.speed_share * ego_mps if self.speed_kmh is None else self.speed_kmh / 3.6
        return min(wanted_mps, ego_mps)


@dataclass(frozen=True, slots=True, kw_only=True)
class Walker:
    """A person on the road in front of the ego car.

    Attributes:
        pace_mps: walking speed across the road, 0 to 5 m/s; 0 stands in the middle of the lane.
        side: side of the road from which the person comes.
        hit_share: share of the ego car's width at which the front would meet the person without braking, 0 to 1,
            counted from the side from which the person comes.
    """

    pace_mps: float = 1.4
    side: Literal["right", "left"] = "right"
    hit_share: float = 0.5

    def __post_init__(self) -> None:
        if not 0 <= self.pace_mps <= 5:
            raise FieldError("pace_mps", f"must be 0 to 5 m/s, got {self.pace_mps:g}")
        if not 0 <= self.hit_share <= 1:
            raise FieldError("hit_share", f"is a share, 0 to 1, got {self.hit_share:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One scenario: what the ego car meets. Without `lead`, `walker` and `red_light` the road is free.

    Attributes:
        summary: description in one line.
        speeds_kmh: speeds of the ego car, km/h.
        ttc_s: time to collision at the start of the drive, or time to the stop line, 1 to 10 s.
        duration_s: length of the drive, 1 to 120 s; it ends earlier when the car has crashed or stands.
        lead: a vehicle ahead.
        walker: a person on the road.
        red_light: whether the next traffic light shows red.
    """

    summary: str = ""
    speeds_kmh: tuple[float, ...] = (20.0, 30.0, 40.0, 50.0, 60.0)
    ttc_s: float = 4.0
    duration_s: float = 10.0
    lead: Lead | None = field(default=None, metadata=WHOLE)
    walker: Walker | None = field(default=None, metadata=WHOLE)
    red_light: bool = False

    def __post_init__(self) -> None:
        if not self.speeds_kmh:
            raise FieldError("speeds_kmh", "names no speed")
        for speed_kmh in self.speeds_kmh:
            if not SPEEDS_KMH[0] <= speed_kmh <= SPEEDS_KMH[1]:
                raise FieldError("speeds_kmh", f"must be {SPEEDS_KMH[0]:g} to {SPEEDS_KMH[1]:g}, got {speed_kmh:g}")
        if not 1 <= self.ttc_s <= 10:
            raise FieldError("ttc_s", f"must be 1 to 10 s, got {self.ttc_s:g}")
        if not 1 <= self.duration_s <= 120:
            raise FieldError("duration_s", f"must be 1 to 120 s, got {self.duration_s:g}")
        if self.lead is not None and self.walker is not None:
            raise FieldError("walker", "a scenario has a lead or a walker, not both")
        if self.red_light and (self.lead is not None or self.walker is not None):
            raise FieldError("red_light", "a scenario with a red light has no lead and no walker")

    @property
    def is_free(self) -> bool:
        """Whether nothing is in the way of the ego car."""
        return self.lead is None and self.walker is None and not self.red_light


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioLibrary:
    """Scenarios by name.

    Attributes:
        scenarios: the scenarios.
        places: file, line and column of each given value, by key.
    """

    scenarios: dict[str, Scenario]
    places: dict[str, Place] = field(default_factory=dict, compare=False, repr=False, metadata=PLACES)

    def __post_init__(self) -> None:
        if not self.scenarios:
            raise FieldError("scenarios", "names no scenario")


def load_scenarios(name: str) -> ScenarioLibrary:
    """Reads a library of scenarios by name, such as `standard`, or by the path of its YAML file.

    Raises:
        UnknownNameError: there is no such library.
        ConfigError: the file cannot be read; the message has file, line and column.
    """
    return read_node(ScenarioLibrary, parse_file(find_config("scenarios", name)))
