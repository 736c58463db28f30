"""Driving sequences: a cast set in motion, frame by frame, without overlaps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from gear.values.errors import PlacementError
from gear.values.geometry import Array, RigidTransform
from gear.values.rng import derive_rng
from gear.world.placement import PlacementSpace
from gear.world.roads.junctions import Junctions
from gear.world.roads.lanes import LaneGraph
from gear.world.roads.routes import Route, drive_on, driven_pose, vehicle_pose
from gear.world.traffic.crowd import Cast
from gear.world.traffic.simulation import Driver, Traffic, Walker, vehicle_discs
from gear.world.traffic.spawn import Draft

ROOM_M = 80.0
SLOWEST_MPS = 1.5
CYCLING_MPS = 5.5
OFF_THE_ROAD_M = 1.2
"""People leave a crossing for so far onto the sidewalk, and stop so far before the end of one."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Moment:
    """Everybody at one frame.

    Attributes:
        drafts: by body, with the speeds of this moment.
        poses: by body.
    """

    drafts: Mapping[str, Draft]
    poses: Mapping[str, RigidTransform]


class Director:
    """Drives casts through time."""

    def __init__(self, scene_name: str, lanes: LaneGraph, space: PlacementSpace) -> None:
        """Takes the town's lanes and what feels overlaps."""
        self._scene_name = scene_name
        self._lanes = lanes
        self._space = space
        self._junctions = Junctions(lanes)

    def drive(self, cast: Cast, seed: int, sequence: int, frames: int, interval_s: float) -> list[Moment]:
        """All frames of a sequence.

        It is driven, who overlaps is taken out of the cast, and it is driven again, until nobody does. So there may be
        fewer on the road than the least count of the scene's limits, which holds for who is placed.

        Raises:
            PlacementError: the ego car itself cannot drive without an overlap.
        """
        while True:
            moments, offender = self._rehearse(cast, seed, sequence, frames, interval_s)
            if offender is None:
                return moments
            if offender in cast.leads:
                raise PlacementError(
                    self._scene_name,
                    f"sequence {sequence}: the ego car cannot drive {frames} frames without an overlap",
                )
            cast.drop(offender)

    def _rehearse(
        self, cast: Cast, seed: int, sequence: int, frames: int, interval_s: float
    ) -> tuple[list[Moment], str | None]:
        """Drives until the end or until somebody overlaps."""
        duration_s = frames * interval_s
        drivers = {
            body: self._driver(cast, draft, seed, sequence, duration_s)
            for body, draft in cast.drafts.items()
            if draft.lane
        }
        walkers = {
            body: self._walker(draft)
            for body, draft in cast.drafts.items()
            if draft.walk is not None and draft.speed_mps > 0
        }
        standing = [
            disc
            for body, draft in cast.drafts.items()
            if body not in drivers and body not in walkers
            for disc in _discs(draft)
        ]
        traffic = Traffic(list(drivers.values()), list(walkers.values()), standing, self._junctions)
        order = {body: number for number, body in enumerate(cast.drafts)}
        moments: list[Moment] = []
        for frame in range(frames):
            if frame:
                traffic.advance(interval_s)
            moment, fallen = self._moment(cast, drivers, walkers, is_still=frames == 1)
            pairs = self._space.overlaps(moment.poses)
            offenders = [max(pair, key=lambda body: order.get(body, -1)) for pair in pairs] + fallen
            if offenders:
                return moments, max(offenders, key=lambda body: order[body])
            moments.append(moment)
        return moments, None

    def _moment(
        self, cast: Cast, drivers: Mapping[str, Driver], walkers: Mapping[str, Walker], *, is_still: bool
    ) -> tuple[Moment, list[str]]:
        """Where everybody is now, and who has no ground below.

        A single picture keeps to the pieces of lanes and walks, as its data set's seed has always placed it.
        """
        drafts: dict[str, Draft] = {}
        poses: dict[str, RigidTransform] = {}
        fallen: list[str] = []
        for body, draft in cast.drafts.items():
            if body in drivers:
                driver = drivers[body]
                half_length_m = draft.kind.half_length_m
                if is_still:
                    point, yaw_rad = vehicle_pose(driver.route.line, driver.s_m, half_length_m, driver.lateral_m)
                    now = _at(draft, point, yaw_rad, driver.speed_mps)
                else:
                    point, yaw_rad, pace = driven_pose(driver.route.line, driver.s_m, half_length_m, driver.lateral_m)
                    now = _at(draft, point, yaw_rad, driver.speed_mps * pace)
            elif body in walkers:
                walker = walkers[body]
                point, yaw_rad = walker.first_place() if is_still else walker.place()
                now = _at(draft, point, yaw_rad, walker.speed_mps)
            else:
                drafts[body], poses[body] = draft, cast.poses[body]
                continue
            standing = self._space.stand(draft.kind, now.x_m, now.y_m, now.near_z_m, now.yaw_rad)
            if standing is None:
                fallen.append(body)
                continue
            drafts[body], poses[body] = now, standing.world_from_actor
        return Moment(drafts=drafts, poses=poses), fallen

    def _driver(self, cast: Cast, draft: Draft, seed: int, sequence: int, duration_s: float) -> Driver:
        lane = self._lanes.lanes[draft.lane]
        cruise_mps = lane.speed_mps * float(
            derive_rng(seed, self._scene_name, "cruise", sequence, draft.body).uniform(0.6, 1.0)
        )
        if draft.role == "ego" and cast.way_m > 0:
            cruise_mps = min(lane.speed_mps, max(SLOWEST_MPS, cast.way_m / duration_s))
        elif draft.kind.facts.kind == "bicycle":
            cruise_mps = min(cruise_mps, CYCLING_MPS)
        way = cast.ways.get(draft.body, (draft.lane,))
        # The ego car and its truck turn the same way at every junction, because they draw the same numbers.
        turns = derive_rng(
            seed, self._scene_name, "route", sequence, "leads" if draft.body in cast.leads else draft.body
        )
        spent_m = sum(self._lanes.lanes[name].line.length_m for name in way[:-1])
        length_m = draft.s_m + lane.speed_mps * duration_s + ROOM_M - spent_m
        lanes = (*way[:-1], *drive_on(self._lanes, way[-1], max(1.0, length_m), turns))
        return Driver(
            route=Route.along(self._lanes, lanes),
            s_m=draft.s_m,
            lateral_m=draft.lateral_m,
            speed_mps=draft.speed_mps,
            cruise_mps=cruise_mps,
            front_m=draft.kind.front_m,
            rear_m=draft.kind.rear_m,
            half_width_m=draft.kind.half_width_m,
        )

    def _walker(self, draft: Draft) -> Walker:
        assert draft.walk is not None
        walk = self._lanes.walks[draft.walk.walk]
        return Walker(
            line=walk.line,
            s_m=draft.walk.s_m,
            lateral_m=draft.walk.lateral_m,
            direction=draft.walk.direction,
            pace_mps=draft.speed_mps,
            speed_mps=draft.speed_mps,
            beyond_m=OFF_THE_ROAD_M if walk.is_crossing else -OFF_THE_ROAD_M,
        )


def _discs(draft: Draft) -> list[tuple[float, float, float, float]]:
    kind = draft.kind
    point_m = np.array([draft.x_m, draft.y_m, draft.near_z_m])
    return vehicle_discs(point_m, draft.yaw_rad, kind.front_m, kind.rear_m, kind.half_width_m)


def _at(draft: Draft, point_m: Array, yaw_rad: float, speed_mps: float) -> Draft:
    return replace(
        draft,
        x_m=float(point_m[0]),
        y_m=float(point_m[1]),
        near_z_m=float(point_m[2]),
        yaw_rad=yaw_rad,
        speed_mps=speed_mps,
    )
