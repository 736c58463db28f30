"""The format of a scene library, which defines where boards stand and which traffic may surround them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TypeVar

from gear.config.nodes import Place
from gear.config.reader import WHOLE
from gear.values.errors import FieldError
from gear.values.scene import Vec3
from gear.values.serial import PLACES
from gear.values.vehicle_mix import check_mix, product_of

Range = tuple[float, float]
CountRange = tuple[int, int]


FACE_SIDE_M = (0.1, 100.0)
"""Smallest and largest side of a face, metres. A smaller face cannot show a patch; a larger face was probably specified
in another unit.
"""

FARTHEST_M = 10_000.0
"""Largest distance from the origin or from the first board, metres. At that distance, the 32-bit floats of
models and renderers have steps of a millimetre.
"""


def _check_range(name: str, value: Range | None, *, least: float = -FARTHEST_M) -> None:
    if value is None:
        return
    low, high = value
    if low > high:
        raise FieldError(name, f"the first number must not exceed the second, got {low:g} and {high:g}")
    if low < least or high > FARTHEST_M:
        raise FieldError(name, f"must lie within {least:g} and {FARTHEST_M:g}, got {low:g} to {high:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardSpec:
    """The position, direction, asset and size of one billboard in a scene.

    Attributes:
        position_m: ground point under the middle of its face, world coordinates, metres.
        facing_deg: direction of the face's outward normal, degrees counter-clockwise from east.
        asset: name of its MJCF file in `mjcf/surfaces`.
        size_m: width and height of its face; None for the size in the asset's file. The whole board is scaled about its
            foot, so a taller face also hangs higher.
        places: line and column in the YAML file of each key that occurs there, for error messages.
    """

    position_m: Vec3
    facing_deg: float
    asset: str = "billboard"
    size_m: tuple[float, float] | None = None
    places: dict[str, Place] = field(default_factory=dict, compare=False, repr=False, metadata=PLACES)

    def __post_init__(self) -> None:
        if max(map(abs, self.position_m)) > FARTHEST_M:
            given = ", ".join(f"{value:g}" for value in self.position_m)
            raise FieldError("position_m", f"must lie within {FARTHEST_M:g} m of the town's origin, got {given}")
        if not -360 <= self.facing_deg <= 360:
            raise FieldError("facing_deg", f"must be -360 to 360 degrees, got {self.facing_deg:g}")
        if not self.asset:
            raise FieldError("asset", "must be the name of a surface's MJCF")
        least_m, most_m = FACE_SIDE_M
        if self.size_m is not None and not all(least_m <= side_m <= most_m for side_m in self.size_m):
            given = " x ".join(f"{side_m:g}" for side_m in self.size_m)
            raise FieldError("size_m", f"must be a width and a height of {least_m:g} to {most_m:g} m, got {given}")


@dataclass(frozen=True, slots=True, kw_only=True)
class EgoLimits:
    """Limits of the ego car's position, in the frame of the first board.

    Attributes:
        ahead_m: smallest and largest distance in front of the face.
        lateral_m: smallest and largest distance to the left of the face's outward normal; negative to the right.
        max_incidence_deg: largest angle between the face's normal and the direction to the reference camera; 0 is
            frontal.
        min_free: smallest share of each face that must be visible to the reference camera.
    """

    ahead_m: Range
    lateral_m: Range
    max_incidence_deg: float = 75.0
    min_free: float = 0.4

    def __post_init__(self) -> None:
        _check_range("ahead_m", self.ahead_m, least=0.0)
        _check_range("lateral_m", self.lateral_m)
        if not 0 < self.max_incidence_deg < 90:
            raise FieldError("max_incidence_deg", f"must lie between 0 and 90 degrees, got {self.max_incidence_deg:g}")
        if not 0 <= self.min_free <= 1:
            raise FieldError("min_free", f"is a share, 0 to 1, got {self.min_free:g}")


ONE_PLACE_M, ONE_WAY_DEG = 0.05, 5.0
"""Two boards that differ by less than this in position (metres) and direction (degrees) count as one board that was
written twice by mistake.
"""


def _is_one_way(board: BoardSpec, other: BoardSpec) -> bool:
    return abs((board.facing_deg - other.facing_deg + 180) % 360 - 180) < ONE_WAY_DEG


MOST_NPCS = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class NpcLimits:
    """Limits on the number and positions of other vehicles or of people.

    Attributes:
        count: smallest and largest number; each number between them is equally likely.
        ahead_m, lateral_m: smallest and largest distances in front of the first board and to its left; None for no
            limit.
        radius_m: smallest and largest distance from the ego car; None for no limit. All limits that are not None must
            hold.
    """

    count: CountRange
    ahead_m: Range | None = None
    lateral_m: Range | None = None
    radius_m: Range | None = None

    def __post_init__(self) -> None:
        low, high = self.count
        if not 0 <= low <= high <= MOST_NPCS:
            raise FieldError("count", f"must be two numbers, 0 to {MOST_NPCS}, the smaller first, got {low} and {high}")
        _check_range("ahead_m", self.ahead_m)
        _check_range("lateral_m", self.lateral_m)
        _check_range("radius_m", self.radius_m, least=0.0)

    @property
    def needs_board(self) -> bool:
        """Whether the limits are relative to a board: `ahead_m` or `lateral_m` is set."""
        return self.ahead_m is not None or self.lateral_m is not None


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleLimits(NpcLimits):
    """Limits on the number, positions and kinds of other vehicles.

    Attributes:
        parked_share: share of the vehicles that are parked, as far as there are free parking bays.
        mix: factors by which kinds of vehicles (`car`, `bus`, …) are more frequent than usual; 0 for never.
    """

    parked_share: float = 0.3
    mix: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        NpcLimits.__post_init__(self)
        check_mix("mix", self.mix)
        if not 0 <= self.parked_share <= 1:
            raise FieldError("parked_share", f"is a share, 0 to 1, got {self.parked_share:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class TruckSpec:
    """A vehicle that carries the patch on its rear and drives ahead of the ego car in the same lane.

    Attributes:
        asset: name of its MJCF file in `mjcf/vehicles`.
        gap_m: smallest and largest distance between the front of the ego car and the rear of the vehicle.
        places: line and column in the YAML file of each key that occurs there, for error messages.
    """

    asset: str = "truck_box"
    gap_m: Range = (3.0, 30.0)
    places: dict[str, Place] = field(default_factory=dict, compare=False, repr=False, metadata=PLACES)

    def __post_init__(self) -> None:
        _check_range("gap_m", self.gap_m, least=0.5)


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneSpec:
    """One scene: boards, a truck, or no surface for patches, and limits for the ego car and the traffic.

    Attributes:
        boards: the boards, which show the patches `patch_0`, `patch_1`, … in this order.
        truck: the vehicle that carries the patch; a scene cannot have both boards and a truck.
        ego: limits of the ego car; required if there are boards. Without boards the ego car may be on any lane.
        npc_vehicles, pedestrians: limits of the other vehicles and of the people.
    """

    boards: tuple[BoardSpec, ...] = ()
    truck: TruckSpec | None = None
    ego: EgoLimits | None = None
    npc_vehicles: VehicleLimits = field(
        default_factory=lambda: VehicleLimits(count=(9, 21), radius_m=(0.0, 80.0)), metadata=WHOLE
    )
    pedestrians: NpcLimits = field(
        default_factory=lambda: NpcLimits(count=(18, 60), radius_m=(0.0, 60.0)), metadata=WHOLE
    )

    def __post_init__(self) -> None:
        if self.boards and self.truck is not None:
            raise FieldError("truck", "a scene has boards or a truck, not both")
        if self.boards and self.ego is None:
            raise FieldError("ego", "a scene with boards needs the limits of the ego car (ahead_m, lateral_m)")
        if not self.boards and self.ego is not None:
            raise FieldError("ego", "limits of the ego car are in the frame of the first board, and there is none")
        for number, board in enumerate(self.boards):
            for earlier, other in enumerate(self.boards[:number]):
                if math.dist(board.position_m, other.position_m) < ONE_PLACE_M and _is_one_way(board, other):
                    raise FieldError("boards", f"{earlier} and {number} stand in one place; each would hide the other")
        for name in ("npc_vehicles", "pedestrians"):
            if not self.boards and getattr(self, name).needs_board:
                raise FieldError(name, "ahead_m and lateral_m are in the frame of the first board; use radius_m")

    def capped(self, max_vehicles: int, max_pedestrians: int) -> SceneSpec:
        """The same scene with upper limits on the counts of road users.

        Args:
            max_vehicles: largest number of other vehicles.
            max_pedestrians: largest number of people.
        """
        return replace(
            self,
            npc_vehicles=_capped(self.npc_vehicles, max_vehicles),
            pedestrians=_capped(self.pedestrians, max_pedestrians),
        )

    def crowded(self, factor: float) -> SceneSpec:
        """The same scene with `factor` times as many other vehicles and people.

        Args:
            factor: factor on the smallest and the largest count.
        """
        if factor == 1:
            return self
        return replace(
            self, npc_vehicles=_multiplied(self.npc_vehicles, factor), pedestrians=_multiplied(self.pedestrians, factor)
        )

    def mixed(self, mix: Mapping[str, float]) -> SceneSpec:
        """The same scene, in which the factors of the vehicle mix are multiplied by the factors in `mix`.

        Args:
            mix: factors by kind of vehicle, such as `{"bus": 3}`.
        """
        if not mix:
            return self
        return replace(self, npc_vehicles=replace(self.npc_vehicles, mix=product_of(self.npc_vehicles.mix, mix)))


LimitsT = TypeVar("LimitsT", bound=NpcLimits)


def _capped(limits: LimitsT, most: int) -> LimitsT:
    low, high = limits.count
    return replace(limits, count=(min(low, most), min(high, most)))


def _multiplied(limits: LimitsT, factor: float) -> LimitsT:
    low, high = limits.count
    return replace(limits, count=(min(round(low * factor), MOST_NPCS), min(round(high * factor), MOST_NPCS)))


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneLibrary:
    """The scenes of one town.

    Attributes:
        town: name of the town in which the scenes take place.
        scenes: scenes by name.
        places: line and column in the YAML file of each key that occurs there, for error messages.
    """

    town: str
    scenes: dict[str, SceneSpec]
    places: dict[str, Place] = field(default_factory=dict, compare=False, repr=False, metadata=PLACES)

    def __post_init__(self) -> None:
        if not self.scenes:
            raise FieldError("scenes", "a scene library needs at least one scene")
        if "" in self.scenes:
            raise FieldError("scenes", "a scene needs a name, such as corner")
