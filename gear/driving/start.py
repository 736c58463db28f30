"""Draws the start of a drive: where the ego car begins, what it will meet, and the other road users around it.

The draw depends only on the scene, the scenario, the speed and the seed: not on the patch, the network or the
controller, so that twins and controllers meet the same situation.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from gear.driving.lane_path import LanePath
from gear.driving.scenario import Lead, Scenario, Walker
from gear.values.errors import PlacementError
from gear.values.geometry import Array
from gear.values.rig import CameraMount, Rig
from gear.values.rng import derive_rng
from gear.world.assets.actor_types import ActorType
from gear.world.placement import PlacementSpace
from gear.world.roads.lanes import LaneGraph
from gear.world.roads.polyline import Polyline
from gear.world.roads.routes import trace_back
from gear.world.roads.traffic_lights import red_lanes, traffic_lights
from gear.world.scene_spec import SceneSpec
from gear.world.traffic.crowd import Crowd, RoadUsers
from gear.world.traffic.ego_sampling import EgoSampler
from gear.world.traffic.footprints import Footprint
from gear.world.traffic.spawn import Spawn, Spawner, draw_paint
from gear.world.world import World

TRIES = 80
IN_VIEW_TTC_S = 2.5
"""Time to collision at which the ego car is at the drawn place, from which the boards are well in view, seconds."""

BEYOND_M = 15.0
"""Length of the road beyond the place of the conflict that a drive needs, metres."""

KEPT_FREE_M = (20.0, 30.0)
"""Distances behind the ego car and beyond the conflict up to which no other road user starts in the lane, metres."""

MOST_LATERAL_MPS2 = 3.0
"""Lateral acceleration that a car at the drawn speed may need between its start and the road beyond the conflict, m/s².
No controller slows down for bends, and around a corner a conflict is not ahead but aside.
"""

TIGHT_BEND = "in a bend too tight for the speed"

FURTHER_M = (0.0, 10.0, 20.0, 30.0, 40.0)
"""Distances by which the start moves away from the boards until the conflict is before the bend, metres."""

BEND_M = 6.0
"""Length of road over which the change of heading is taken, so that the corners of the centre line do not count as
bends, metres.
"""

LEAST_GAP_M = 6.0
REACH_M = 3.0
"""Distance that a person walks beyond the edges of the lane, metres."""

SAME_RIG = Rig(cameras=(CameraMount(name="reference", width_px=1224, height_px=370),))
"""The camera by which places before a board are judged, the same for all networks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Draw:
    """What decides the start of a drive.

    Attributes:
        name: name of the scenario, which seeds the random draws.
        scenario: the scenario.
        speed_mps: speed of the ego car.
        seed: seed of all draws.
    """

    name: str
    scenario: Scenario
    speed_mps: float
    seed: int


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class LeadStart:
    """The scripted vehicle ahead.

    Attributes:
        body: name of its body in the placement model.
        s_m: arc length of its middle on the ego car's route.
        speed_mps: its speed.
        lateral_m: distance to the left of the centre line; not 0 before it cuts in.
        cut_in: its change of lane: time at which it begins, and the time that it takes, in seconds; None without one.
    """

    body: str
    s_m: float
    speed_mps: float
    lateral_m: float = 0.0
    cut_in: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class WalkerStart:
    """The scripted person.

    Attributes:
        body: name of the person's body in the placement model.
        line: line across the road on which the person walks, from the start on.
        pace_mps: walking speed; 0 for a person who stands.
        waits_s: time at which the person begins to walk.
    """

    body: str
    line: Polyline
    pace_mps: float
    waits_s: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Start:
    """The start of a drive.

    Attributes:
        road_users: the ego car first, then the scripted road user, then all others.
        path: the lanes that the ego car follows.
        s_m: arc length of the ego car's middle on the path.
        speed_mps: speed of the ego car at the start, and its desired speed.
        conflict_s_m: arc length up to which a car that does nothing drives until it crashes, or until its front is at
            the stop line of the red light; infinite on a free road.
        lead, walker: the scripted road user, if there is one.
    """

    road_users: RoadUsers
    path: LanePath
    s_m: float
    speed_mps: float
    conflict_s_m: float = math.inf
    lead: LeadStart | None = None
    walker: WalkerStart | None = None


class StartSampler:
    """Draws starts of drives in one world: where the ego car, the scripted road users and all others begin."""

    def __init__(self, world: World, crowd: SceneSpec, space: PlacementSpace) -> None:
        """Prepares the data that all drives share.

        Args:
            world: the compiled world.
            crowd: the scene with the numbers of the other road users; `world` may hold more actors.
            space: the placement model of the world.
        """
        spawner = Spawner(world.lanes)
        self._world, self._space, self._lanes = world, space, world.lanes
        self._red_lanes = red_lanes(world.lanes, traffic_lights(world.model, world.statics))
        self._sampler = EgoSampler(
            scene_name=world.scene_name,
            scene=world.scene,
            rig=SAME_RIG,
            types=world.types,
            slots=world.slots,
            faces=world.faces,
            spawner=spawner,
            space=space,
        )
        self._crowd = Crowd(scene_name=world.scene_name, scene=crowd, types=world.types, spawner=spawner, space=space)

    def draw(self, what: Draw) -> Start:
        """Draws the start of a drive: ego car, scripted road users, and the other traffic.

        Args:
            what: scenario, speed and seed; equal values give the same start.

        Raises:
            PlacementError: the scene has no place for the scenario; the message says why.
        """
        truck = self._world.scene.truck
        has_no_place = (
            what.scenario.walker or what.scenario.red_light or (what.scenario.lead and what.scenario.lead.cut_in)
        )
        if truck is not None and has_no_place:
            problem = (
                f"scenario {what.name}: behind a truck there is no place for a person, a car that cuts in or a light"
            )
            raise PlacementError(self._world.scene_name, f"{problem}; use a scene with boards")
        problems: Counter[str] = Counter()
        for attempt in range(TRIES):
            rng = derive_rng(what.seed, self._world.scene_name, "drive", what.name, attempt)
            found = self._place(what, rng)
            if isinstance(found, Start):
                self._crowd.fill(found.road_users, what.seed, 0)
                return found
            problems[found] += 1
        listed = ", ".join(f"{count} {problem}" for problem, count in problems.most_common())
        raise PlacementError(
            self._world.scene_name,
            f"scenario {what.name} at {what.speed_mps * 3.6:.0f} km/h: no place in {TRIES} tries ({listed}); choose"
            " another scene or a lower speed",
        )

    def _place(self, what: Draw, rng: np.random.Generator) -> Start | str:
        speed_mps, scenario = what.speed_mps, what.scenario
        lane, view_s_m = self._sampler.spawner.lane_table.draw(self._sampler.places, rng)
        back_m = max(0.0, scenario.ttc_s - IN_VIEW_TTC_S) * speed_mps
        if scenario.red_light:
            line_m = self._stop_line_m(lane, view_s_m, scenario.ttc_s * speed_mps)
            if line_m is None:
                return "without a red light ahead"
            back_m = view_s_m - (line_m - self._sampler.ego_type.front_m - scenario.ttc_s * speed_mps)
        way: tuple[LanePath, float] | str = ""
        for further_m in (0.0,) if scenario.red_light else FURTHER_M:
            way = self._way(what, (lane, view_s_m), back_m + further_m, rng)
            if way != TIGHT_BEND:
                break
        if isinstance(way, str):
            return way
        path, s_m = way
        road_users = self._sampler.empty()
        ego = replace(self._sampler.ego_on_lane(road_users, path.route.lanes[0], s_m, rng), speed_mps=speed_mps)
        start = Start(road_users=road_users, path=path, s_m=s_m, speed_mps=speed_mps)
        if scenario.red_light:
            start = replace(start, conflict_s_m=s_m + scenario.ttc_s * speed_mps)
        scripted = self._scripted(start, scenario, rng)
        if isinstance(scripted, str):
            return scripted
        start, others = scripted
        problem = self._sampler.enter(road_users, [ego, *others])
        if problem is not None:
            return problem
        road_users.keep_out.extend(_kept_free(start))
        return start

    def _way(
        self, what: Draw, view: tuple[str, float], back_m: float, rng: np.random.Generator
    ) -> tuple[LanePath, float] | str:
        """Finds the lanes that lead to a place before the boards, and beyond.

        Args:
            what: scenario, speed and seed.
            view: the place: name of its lane, and arc length on it.
            back_m: distance of the start before the place, metres.
            rng: generator of the choice between lanes that lead to the place.

        Returns:
            The path and the arc length of the start on it; or the reason why no drive is possible.
        """
        speed_mps, scenario = what.speed_mps, what.scenario
        way = trace_back(self._lanes, *view, back_m, rng)
        if way is None:
            return "before the start of the road"
        names, s_m = way
        needed_m = scenario.ttc_s * speed_mps + BEYOND_M + 40.0
        path = LanePath.along(self._lanes, (*names[:-1], *straight_on(self._lanes, names[-1], s_m + needed_m)))
        if path.route.is_dead_end and path.route.line.length_m < s_m + scenario.ttc_s * speed_mps + BEYOND_M:
            return "before the end of the road"
        driven_s = max(scenario.ttc_s, scenario.duration_s if scenario.is_free else 0.0)
        if lateral_mps2(path, s_m, s_m + driven_s * speed_mps + BEYOND_M, speed_mps) > MOST_LATERAL_MPS2:
            return TIGHT_BEND
        return path, s_m

    def _stop_line_m(self, lane: str, s_m: float, reach_m: float) -> float | None:
        """Finds the first red light ahead.

        Args:
            lane: name of the lane of the position.
            s_m: arc length of the position on that lane.
            reach_m: largest distance from the position at which a light counts.

        Returns:
            Arc length of its stop line, straight on from the start of `lane`; None without a red light.
        """
        front_m, end_m = self._sampler.ego_type.front_m, 0.0
        for name in straight_on(self._lanes, lane, s_m + reach_m):
            end_m += self._lanes.lanes[name].line.length_m
            if name in self._red_lanes and s_m + front_m < end_m <= s_m + front_m + reach_m:
                return end_m
        return None

    def _scripted(self, start: Start, scenario: Scenario, rng: np.random.Generator) -> tuple[Start, list[Spawn]] | str:
        """Adds the scripted road user; returns a problem where there is no place for it."""
        if self._world.scene.truck is not None:
            return self._behind_truck(start, scenario, rng)
        if scenario.lead is not None:
            return self._with_lead(start, scenario, scenario.lead, rng)
        if scenario.walker is not None:
            return self._with_walker(start, scenario, scenario.walker, rng)
        return start, []

    def _behind_truck(self, start: Start, scenario: Scenario, rng: np.random.Generator) -> tuple[Start, list[Spawn]]:
        slot = next(slot for slot in self._world.slots if slot.carries_surface)
        actor_type = self._world.types[slot.actor.name]
        lead = scenario.lead or Lead(speed_share=1.0)
        placed, spawn = self._lead(start, scenario, lead, (actor_type, slot.body), rng)
        return placed, [replace(spawn, role="carrier")]

    def _with_lead(
        self, start: Start, scenario: Scenario, lead: Lead, rng: np.random.Generator
    ) -> tuple[Start, list[Spawn]] | str:
        cars = [
            actor_type
            for name, actor_type in self._world.types.items()
            if actor_type.facts.kind == "car" and start.road_users.free.bodies.get(name)
        ]
        if not cars:
            return "without a car among the scene's vehicles"
        actor_type = cars[int(rng.integers(len(cars)))]
        lateral_m = 0.0
        if lead.cut_in is not None:
            lane = self._lanes.lanes[start.path.route.lanes[start.path.route.lane_at(start.s_m)]]
            if not (lane.left or lane.right):
                return "without a neighbouring lane"
            neighbour = self._lanes.lanes[lane.left or lane.right]
            lateral_m = (lane.width_m + neighbour.width_m) / 2 * (1 if lane.left else -1)
        body = start.road_users.free.take(actor_type.facts.name)
        placed, spawn = self._lead(start, scenario, lead, (actor_type, body), rng, lateral_m)
        return placed, [spawn]

    def _lead(
        self,
        start: Start,
        scenario: Scenario,
        lead: Lead,
        actor: tuple[ActorType, str],
        rng: np.random.Generator,
        lateral_m: float = 0.0,
    ) -> tuple[Start, Spawn]:
        actor_type, body = actor
        lead_mps = lead.speed_mps(start.speed_mps)
        closing_mps = start.speed_mps - lead_mps
        ego_front_m = self._sampler.ego_type.front_m
        gap_m = max(LEAST_GAP_M, closing_mps * scenario.ttc_s)
        if closing_mps <= 0:
            gap_m = LEAST_GAP_M + 1.5 * start.speed_mps
        s_m = start.s_m + ego_front_m + gap_m + actor_type.rear_m
        cut_in = None
        if lead.cut_in is not None:
            cut_in = (max(0.0, scenario.ttc_s - lead.cut_in.at_ttc_s), lead.cut_in.takes_s)
        placed = LeadStart(body=body, s_m=s_m, speed_mps=lead_mps, lateral_m=lateral_m, cut_in=cut_in)
        conflict_s_m = start.s_m + start.speed_mps * scenario.ttc_s if closing_mps > 0 else math.inf
        point, yaw_rad = start.path.route.line.at(s_m, lateral_m)
        spawn = _spawn(actor_type, body, point, yaw_rad, lead_mps, rng)
        return replace(start, lead=placed, conflict_s_m=conflict_s_m), spawn

    def _with_walker(
        self, start: Start, scenario: Scenario, walker: Walker, rng: np.random.Generator
    ) -> tuple[Start, list[Spawn]] | str:
        people = [
            actor_type
            for name, actor_type in self._world.types.items()
            if actor_type.is_person and actor_type.facts.gait == "walk" and start.road_users.free.bodies.get(name)
        ]
        if not people:
            return "without a walking person among the scene's people"
        actor_type = people[int(rng.integers(len(people)))]
        body = start.road_users.free.take(actor_type.facts.name)
        ego = self._sampler.ego_type
        s_m = start.s_m + ego.front_m + start.speed_mps * scenario.ttc_s + actor_type.half_length_m
        line = _line_across(start.path, s_m, walker)
        # Where the front meets the person: hit_share of the car's width, from the person's side.
        meets_m = line.length_m / 2 + (walker.hit_share - 0.5) * 2 * ego.half_width_m
        waits_s = max(0.0, scenario.ttc_s - meets_m / walker.pace_mps) if walker.pace_mps > 0 else 0.0
        begins_m = max(0.0, meets_m - scenario.ttc_s * walker.pace_mps) if walker.pace_mps > 0 else line.length_m / 2
        points = np.array([line.at(begins_m)[0], line.points_m[-1]])
        walk = WalkerStart(body=body, line=Polyline.through(points), pace_mps=walker.pace_mps, waits_s=waits_s)
        point, yaw_rad = walk.line.at(0.0)
        spawn = _spawn(actor_type, body, point, yaw_rad, 0.0, rng)
        conflict_s_m = s_m - ego.front_m - actor_type.half_length_m
        return replace(start, walker=walk, conflict_s_m=conflict_s_m), [spawn]


def _spawn(
    actor_type: ActorType, body: str, point_m: Array, yaw_rad: float, speed_mps: float, rng: np.random.Generator
) -> Spawn:
    """A scripted road user at a point (3,) on the ground."""
    return Spawn(
        role="pedestrian" if actor_type.is_person else "npc",
        actor_type=actor_type,
        body=body,
        x_m=float(point_m[0]),
        y_m=float(point_m[1]),
        near_z_m=float(point_m[2]),
        yaw_rad=yaw_rad,
        speed_mps=speed_mps,
        paint_rgb=draw_paint(actor_type, rng),
    )


def _line_across(path: LanePath, s_m: float, walker: Walker) -> Polyline:
    """The line across the lane on which a person walks, from the person's side on; its middle is on the centre line."""
    half_m = path.widths_m[path.route.lane_at(s_m)] / 2 + REACH_M
    signs = (-1.0, 1.0) if walker.side == "right" else (1.0, -1.0)
    return Polyline.through(np.array([path.route.line.at(s_m, sign * half_m)[0] for sign in signs]))


def _kept_free(start: Start) -> list[Footprint]:
    """The areas in which no other road user may start: the ego car's lane, the scripted road user's way."""
    behind_m, beyond_m = KEPT_FREE_M
    last_m = start.conflict_s_m if math.isfinite(start.conflict_s_m) else start.s_m + 4 * start.speed_mps
    if start.lead is not None:
        last_m = max(last_m, start.lead.s_m)
    areas = []
    laterals_m = {0.0, start.lead.lateral_m if start.lead is not None else 0.0}
    for lateral_m in sorted(laterals_m):
        for s_m in np.arange(start.s_m - behind_m, last_m + beyond_m, 4.0):
            point, yaw_rad = start.path.route.line.at(float(s_m), lateral_m)
            width_m = start.path.widths_m[start.path.route.lane_at(float(s_m))]
            areas.append(Footprint(float(point[0]), float(point[1]), float(point[2]), yaw_rad, 2.5, width_m / 2))
    if start.walker is not None:
        middle, yaw_rad = start.walker.line.at(start.walker.line.length_m / 2)
        half_m = start.walker.line.length_m / 2
        areas.append(Footprint(float(middle[0]), float(middle[1]), float(middle[2]), yaw_rad, half_m + 1.5, 1.5))
    return areas


def lateral_mps2(path: LanePath, from_m: float, to_m: float, speed_mps: float) -> float:
    """Returns the largest lateral acceleration on a stretch of a path, in m/s².

    Args:
        path: the lanes that the car follows.
        from_m, to_m: arc lengths of the stretch, metres.
        speed_mps: speed of the car.
    """
    _, headings = path.route.line.sample(np.arange(from_m, max(to_m, from_m + BEND_M) + BEND_M, 1.0))
    headings = np.unwrap(headings)
    width = round(BEND_M)
    turns = np.abs(headings[width:] - headings[:-width]) / BEND_M
    return float(speed_mps**2 * turns.max())


def straight_on(graph: LaneGraph, lane: str, length_m: float) -> tuple[str, ...]:
    """Follows the lanes straight on: at every branch it takes the lane that turns least.

    Args:
        graph: the lanes of the town.
        lane: name of the first lane.
        length_m: length at which the search ends, in metres, counted from the start of the first lane.

    Returns:
        Names of the lanes in driving order. Together the lanes are shorter than `length_m` if the road ends earlier.
    """
    names, total_m = [lane], graph.lanes[lane].line.length_m
    while total_m < length_m and graph.lanes[names[-1]].next:
        names.append(min(graph.lanes[names[-1]].next, key=lambda name: (_turn_rad(graph, name), name)))
        total_m += graph.lanes[names[-1]].line.length_m
    return tuple(names)


def _turn_rad(graph: LaneGraph, lane: str) -> float:
    """How much a lane turns from its start to its end, radians."""
    line = graph.lanes[lane].line
    turn_rad = line.at(line.length_m)[1] - line.at(0.0)[1]
    return abs(math.remainder(turn_rad, 2 * math.pi))
