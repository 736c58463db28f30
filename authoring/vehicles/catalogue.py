"""All vehicles by name, and the writing of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from authoring.mesh import Floats
from authoring.vehicles.atlas import write_atlases
from authoring.vehicles.bus import fit_bus
from authoring.vehicles.bus_inside import write_bus_inside
from authoring.vehicles.car import CarSpec, build_car, side_lines
from authoring.vehicles.car_inside import look_inside, write_car_inside
from authoring.vehicles.cars import ESTATE, SALOON, SPORTS
from authoring.vehicles.finish import Box, Finish, PaintMap, write_vehicle
from authoring.vehicles.fittings import (
    add_antenna,
    add_badge,
    add_exhaust,
    add_handles,
    add_light_bar,
    add_mirrors,
    add_plate,
    add_rails,
    add_roof_sign,
    add_wipers,
)
from authoring.vehicles.hatchbacks import CITY, HATCHBACK, SUV
from authoring.vehicles.heavy import BUS
from authoring.vehicles.parts import Parts
from authoring.vehicles.shell import Shell
from authoring.vehicles.trucks import write_box_truck, write_flatbed
from authoring.vehicles.vans import AMBULANCE, PICKUP, POLICE, TAXI, VAN

__all__ = ["CATALOGUE", "write"]

Extra = Callable[[CarSpec, Parts, Shell, Shell], None]


def _car(
    spec: CarSpec, extra: Extra | None = None, draw_inside: Callable[[Path], None] | None = None
) -> Callable[[Path], None]:
    def make(out: Path) -> None:
        parts, body, cabin = build_car(spec)
        if draw_inside is None:
            look_inside(parts, cabin)
        _fit(spec, parts, body, cabin)
        if extra is not None:
            extra(spec, parts, body, cabin)
        meshes = parts.merged()
        bounds = meshes["paint"].bounds
        finish = Finish(
            spec.name, spec.kind, spec.palette, _boxes(spec, bounds, cabin), shown=spec.shown,
            own_inside=draw_inside is not None,
        )  # fmt: skip
        lines = (side_lines(spec, cabin), spec.lines_top, spec.lines_front, spec.lines_rear)
        paint = PaintMap(bounds[0], bounds[1], spec.paint_px, *lines)
        write_vehicle(out, finish, meshes, paint)
        if draw_inside is not None:
            draw_inside(out / spec.name / "inside.png")

    return make


def _fit(spec: CarSpec, parts: Parts, body: Shell, cabin: Shell) -> None:
    front = cabin.side.patch.evaluate(np.array([[cabin.corners[0], 0.14]]))[0]
    behind = 0.13 if spec.kind == "car" else 0.22
    if spec.mirror is not None:
        add_mirrors(parts, cabin, float(front[0]) - behind, float(front[2]), size=spec.mirror, paint=_mirror_part(spec))
    add_handles(parts, body, spec.handles)
    for plate_z, ahead in zip(spec.plates, (True, False), strict=True):
        add_plate(parts, body, plate_z, ahead, stand_off=spec.plate_stand_off)
    add_wipers(parts, cabin)
    for z, ahead in zip(spec.badges, (True, False), strict=True):
        if z is not None:
            add_badge(parts, body, z, ahead)
    if spec.rails:
        add_rails(parts, cabin, *spec.rails)


def _mirror_part(spec: CarSpec) -> str:
    return "paint" if spec.kind == "car" else "trim"


def _boxes(spec: CarSpec, bounds: Floats, cabin: Shell) -> tuple[Box, ...]:
    """Returns a box around the body and a box around the cabin, without the mirrors."""
    half = max(y for _, y in spec.plan) + 0.02
    foot = cabin.side.points
    belt, low = float(foot[:, 2].min()) + 0.05, 0.12
    front, rear = spec.plan[0][0], spec.plan[-1][0]
    top = float(bounds[1, 2])
    cabin_front, cabin_rear = float(foot[:, 0].max()) - 0.25, float(foot[:, 0].min()) + 0.1
    wide = float(foot[:, 1].max())
    return (
        _span((rear, front), half, (low, belt)),
        _span((cabin_rear, cabin_front), wide, (belt, top)),
    )


def _span(x: tuple[float, float], half: float, z: tuple[float, float]) -> Box:
    return Box(
        (round((x[1] - x[0]) / 2, 3), round(half, 3), round((z[1] - z[0]) / 2, 3)),
        (round((x[0] + x[1]) / 2, 3), 0.0, round((z[0] + z[1]) / 2, 3)),
    )


def _fin(spec: CarSpec, parts: Parts, body: Shell, cabin: Shell) -> None:
    add_antenna(parts, cabin, float(cabin.top.points[:, 0].min()) + 0.25)
    add_exhaust(parts, spec.plan[-1][0] + 0.05, 0.52, float(body.side.points[:, 2].min()) + 0.03)


def _sports(spec: CarSpec, parts: Parts, body: Shell, cabin: Shell) -> None:
    for y in (0.42, 0.54):
        add_exhaust(parts, spec.plan[-1][0] + 0.07, y, 0.235, 0.045, both=True)


def _taxi(spec: CarSpec, parts: Parts, body: Shell, cabin: Shell) -> None:
    add_roof_sign(parts, cabin, -0.15)


def _police(spec: CarSpec, parts: Parts, body: Shell, cabin: Shell) -> None:
    add_light_bar(parts, cabin, -0.35)


def _ambulance(spec: CarSpec, parts: Parts, body: Shell, cabin: Shell) -> None:
    add_light_bar(parts, cabin, 0.35, 1.3)


CATALOGUE: dict[str, Callable[[Path], None]] = {
    **{spec.name: _car(spec, _fin) for spec in (HATCHBACK, SALOON, ESTATE, SUV)},
    **{spec.name: _car(spec) for spec in (CITY, PICKUP, VAN)},
    SPORTS.name: _car(SPORTS, _sports),
    TAXI.name: _car(TAXI, _taxi),
    POLICE.name: _car(POLICE, _police),
    AMBULANCE.name: _car(AMBULANCE, _ambulance),
    BUS.name: _car(BUS, fit_bus, write_bus_inside),
    "truck_box": write_box_truck,
    "truck_rigid": write_flatbed,
}


def write(out: Path, names: Sequence[str]) -> None:
    """Writes the named vehicles and the textures they share into a folder."""
    common = out / "common"
    common.mkdir(parents=True, exist_ok=True)
    write_atlases(common)
    write_car_inside(common / "inside.png")
    for name in names:
        CATALOGUE[name](out)
