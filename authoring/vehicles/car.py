"""A car from a specification: two shells (body and cabin), shapes that are cut into them, and parts that are added."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from shapely import box, line_merge  # type: ignore[import-untyped]

from authoring.mesh import Floats, Mesh
from authoring.vehicles.atlas import DETAILS, LAMPS, cell_uvs, flat
from authoring.vehicles.parts import Parts
from authoring.vehicles.patches import arch_flare, through
from authoring.vehicles.shapes import Shape, disc, rounded
from authoring.vehicles.sheet import Field, Sheet
from authoring.vehicles.shell import Level, Shell, make_shell
from authoring.vehicles.thin import thin
from authoring.vehicles.wheels import WheelSpec, make_wheel

__all__ = ["CarSpec", "Points", "Stamp", "build_car", "side_lines"]

Points = tuple[tuple[float, float], ...]

_BESIDE_GLASS_M = 0.034
"""Distance of the shut line of the doors from the side windows, metres."""


@dataclass(frozen=True)
class Stamp:
    """A shape that is cut into the front, the rear or the side of the body.

    Attributes:
        at: where the shape is: on "front" and "rear" its coordinates are the distance along the outline from the middle
            of that end, and z; on "side" they are x and z.
        corners: corners of the polygon, counter-clockwise, metres.
        radius: radius of rounded corners, metres.
        part: "trim" or "lights".
        cell: cell of the texture.
        sink: depth below the surface of the body, metres.
        rim: width of a dark frame (trim) around the shape, metres.
    """

    at: str
    corners: Points
    radius: float
    part: str
    cell: str
    sink: float = 0.0
    rim: float = 0.0


@dataclass(frozen=True)
class CarSpec:
    """The specification of a car; lengths are metres, and x points forwards from the middle of the car.

    Attributes:
        name, kind, palette: name of the file, its `actor.kind`, and a key of `finish.PALETTES`.
        shown: number of the palette's colour in the file itself.
        plan, foot, rim, crown, levels, reach: shell of the body, as the arguments of `make_shell`.
        cabin_plan, cabin_foot, cabin_rim, cabin_crown, cabin_levels, cabin_reach: shell of the cabin.
        rise: length of the slope of the cabin; the heights of windows below are shares of it.
        axles, wheel, track: x of each axle, the wheels, and the distance between the middles of left and right wheels.
        arch, flare, cladding: gap around a tyre, bulge of the body there, and width of the black lip around it.
        sill_z: height below which the body is black plastic.
        stamps: lamps, grilles and liveries.
        pillar: half the width of a pillar of the windscreen.
        screen_v, side_v: lower and upper edge of windscreen and side windows.
        side_glass: gaps between the side windows and the cabin's front and rear corners.
        rear_glass: gap to the rear corner, lower and upper edge.
        glass_posts: (x, width) of dark posts across the side windows.
        blind_sides: range of x without side windows.
        lines_side, lines_top, lines_front, lines_rear: shut lines, as in `PaintMap`.
        door_rear: x behind which no door has a window; None if the side windows have no doors around them.
        handles: (x, z) of door handles. rails: front x, rear x and y of roof rails.
        mirror: size of a door mirror, if the car has any.
        plates, badges: z at front and rear; `plate_stand_off` is the distance of plates from the body.
        bed: rear x, front x and half width of a pick-up's bed.
        paint_px: width and height of the paint's texture.
    """

    name: str
    plan: Points
    foot: Points
    rim: Points
    crown: Points
    levels: tuple[Level, ...]
    cabin_plan: Points
    cabin_foot: Points
    cabin_rim: Points
    cabin_crown: Points
    cabin_levels: tuple[Level, ...]
    axles: tuple[float, ...]
    wheel: WheelSpec
    track: float
    stamps: tuple[Stamp, ...] = ()
    kind: str = "car"
    palette: str = "car"
    cabin_reach: tuple[float, float] = (1.0, 1.0)
    reach: tuple[float, float] = (0.9, 0.9)
    rise: float = 0.62
    arch: float = 0.055
    flare: float = 0.016
    cladding: float = 0.0
    sill_z: float = 0.0
    pillar: float = 0.05
    screen_v: tuple[float, float] = (0.05, 0.93)
    side_v: tuple[float, float] = (0.10, 0.84)
    side_glass: tuple[float, float] = (0.07, 0.10)
    rear_glass: tuple[float, float, float] = (0.10, 0.10, 0.90)
    glass_posts: tuple[tuple[float, float], ...] = ()
    blind_sides: tuple[float, float] | None = None
    lines_side: tuple[Points, ...] = ()
    lines_top: tuple[Points, ...] = ()
    lines_front: tuple[Points, ...] = ()
    lines_rear: tuple[Points, ...] = ()
    door_rear: float | None = None
    handles: Points = ()
    plates: tuple[float, float] = (0.45, 0.6)
    plate_stand_off: float = 0.012
    badges: tuple[float | None, float | None] = (None, None)
    shown: int = 0
    rails: tuple[float, float, float] | None = None
    mirror: tuple[float, float, float] | None = (0.11, 0.20, 0.14)
    bed: tuple[float, float, float] | None = None
    paint_px: tuple[int, int] = (512, 256)


def build_car(spec: CarSpec) -> tuple[Parts, Shell, Shell]:
    """Builds body, cabin, glass, stamped lamps and grilles, wheels and wheel wells.

    Returns:
        The parts, and the shells of body and cabin, on which further parts are placed.
    """
    hub_z = spec.wheel.radius
    arch = spec.wheel.radius + spec.arch
    body = make_shell(
        spec.plan, spec.levels, through(spec.foot), through(spec.rim), through(spec.crown), cells=(18, 9, 4),
        deform=arch_flare(spec.axles, hub_z, arch, spec.flare),
        shift_reach=spec.reach,
        extra_u=[a + d for a in spec.axles for d in (-arch, -arch * 0.6, 0.0, arch * 0.6, arch)],
    )  # fmt: skip
    cabin = make_shell(
        spec.cabin_plan, spec.cabin_levels, through(spec.cabin_foot), through(spec.cabin_rim),
        through(spec.cabin_crown), shift_reach=spec.cabin_reach, cells=(18, 7, 4), corner_deg=50,
    )  # fmt: skip
    parts = Parts()
    _cut_wells(spec, body, arch)
    stamped = [_stamp(body, stamp) for stamp in spec.stamps]
    _glaze(spec, cabin)
    _hide_under(cabin, body)
    if spec.bed is not None:
        _cut_bed(spec.bed, body)
    for sheet in (body.side, body.top, cabin.side, cabin.top):
        thin(sheet)
    _line_wells(spec, body, arch, parts)
    for stamp, name in zip(spec.stamps, stamped, strict=True):
        _add_stamp(body, stamp, name, parts)
    if spec.bed is not None:
        _sink_bed(body, parts)
    parts.add("paint", body.side.part("paint"), both_sides=True)
    parts.add("paint", body.top.part("paint"), both_sides=True)
    parts.add("trim", flat(body.side.part("trim"), DETAILS["plastic"]), both_sides=True)
    parts.add("trim", flat(body.foot(), DETAILS["rubber"]), both_sides=True)
    for sheet in (cabin.side, cabin.top):
        parts.add("paint", sheet.part("paint"), both_sides=True)
        parts.add("glass", sheet.part("glass"), both_sides=True)
        parts.add("trim", flat(sheet.part("trim"), DETAILS["gloss"]), both_sides=True)
    _wheels(spec, parts)
    return parts, body, cabin


def _side_view(points: Floats) -> Floats:
    """(N, 2) x and z."""
    return points[:, [0, 2]]


def _cut_wells(spec: CarSpec, body: Shell, arch: float) -> None:
    beside: Field = lambda p, q: 0.3 - p[:, 1]  # noqa: E731
    for x in spec.axles:
        ring = disc(x, spec.wheel.radius, arch)
        if spec.cladding:
            wide = disc(x, spec.wheel.radius, arch + spec.cladding)
            body.side.stamp(_seen(wide), "trim", where=beside, finest_m=0.05)
        body.side.stamp(_seen(ring), "hole", where=beside, finest_m=0.035)
    if spec.sill_z:
        below: Field = lambda p, q: p[:, 2] - spec.sill_z  # noqa: E731
        body.side.stamp(below, "trim", on=("paint",), finest_m=0.2)


def _line_wells(spec: CarSpec, body: Shell, arch: float, parts: Parts) -> None:
    edges = body.side.border("hole")
    points = body.side.points
    inner = spec.track / 2 - spec.wheel.width / 2 - 0.10
    a, b = points[edges[:, 0]], points[edges[:, 1]]
    floor = through(spec.foot)
    deep_a, deep_b = a * [1, 0, 1] + [0, inner, 0], b * [1, 0, 1] + [0, inner, 0]
    corners = np.stack([a, b, deep_b, deep_a], axis=1).reshape(-1, 3)
    base = np.arange(len(edges))[:, None] * 4
    tunnel = Mesh.of(corners, np.concatenate([base + np.array(half) for half in ((0, 1, 2), (0, 2, 3))]))
    parts.add("trim", flat(tunnel, DETAILS["rubber"]), both_sides=True)
    for x in spec.axles:
        # The disc that closes the well ends at the floor, or its back would show below.
        dip = np.arcsin((floor(np.array([x]))[0] - spec.wheel.radius) / (1.02 * arch))
        angle = np.linspace(dip, np.pi - dip, 19)
        across, up = 1.02 * arch * np.cos(angle), 1.02 * arch * np.sin(angle)
        rim = np.stack([x + across, np.full(19, inner), spec.wheel.radius + up], axis=-1)
        middle = np.array([[x, inner, spec.wheel.radius]])
        fan = np.stack([np.full(18, 19), np.arange(1, 19), np.arange(18)], axis=1)
        parts.add("trim", flat(Mesh.of(np.concatenate([rim, middle]), fan), DETAILS["rubber"]), both_sides=True)


def _seen(shape: Shape) -> Field:
    return lambda p, q: shape(_side_view(p))


def _on_sheet(body: Shell, stamp: Stamp, points: Floats, params: Floats) -> Floats:
    """Returns points of the body, (N, 2), in the coordinates of a stamp."""
    if stamp.at == "side":
        return _side_view(points)
    run = body.along(params[:, 0])
    return np.stack([run if stamp.at == "front" else body.arc_m - run, points[:, 2]], axis=1)


def _stamp(body: Shell, stamp: Stamp) -> str:
    """Cuts a stamp into the body, and returns the name of its faces."""

    def field_of(shape: Shape) -> Field:
        return lambda p, q: shape(_on_sheet(body, stamp, p, q))

    solid = ("paint", "trim")
    own = f"{stamp.part}:{stamp.cell}:{len(body.side.faces)}"
    if stamp.at == "side":
        near = field_of(rounded(stamp.corners, 0.0, 0.4))
        for z in (min(z for _, z in stamp.corners), max(z for _, z in stamp.corners)):
            body.side.cut(_offset(2, z), where=near, on=solid)
    if stamp.rim:
        frame = field_of(rounded(stamp.corners, stamp.radius, stamp.rim))
        body.side.stamp(frame, "trim", on=solid, finest_m=0.02, bend_m=0.003)
    body.side.stamp(field_of(rounded(stamp.corners, stamp.radius)), own, on=solid, finest_m=0.012, bend_m=0.003)
    return own


def _add_stamp(body: Shell, stamp: Stamp, own: str, parts: Parts) -> None:
    mesh = body.side.part(own, stamp.sink)
    low, high = np.min(stamp.corners, axis=0), np.max(stamp.corners, axis=0)
    low = np.maximum(low, [0, -9]) if stamp.at != "side" else low
    faces = body.side.faces_of(own)
    flat_at = _on_sheet(body, stamp, body.side.points, body.side.params)[np.unique(faces)]
    cells = DETAILS if stamp.part == "trim" else LAMPS
    uvs = cell_uvs(cells[stamp.cell], (flat_at - low) / (high - low))
    parts.add(stamp.part, mesh.with_uvs(uvs), both_sides=True)
    if stamp.sink > 0.005:
        parts.add("trim", flat(body.side.walls(own, stamp.sink), DETAILS["gloss"]), both_sides=True)


def _glaze(spec: CarSpec, cabin: Shell) -> None:
    sheet = cabin.side
    rise = spec.rise
    front, rear = cabin.along(np.array(cabin.corners))
    pane = [
        (-1.0, front - spec.pillar, *spec.screen_v, 0.05),
        (front + spec.side_glass[0], rear - spec.side_glass[1], *spec.side_v, 0.045),
        (rear + spec.rear_glass[0], cabin.arc_m + 1.0, *spec.rear_glass[1:], 0.06),
    ]
    cowl = rounded([(-1.0, -0.2), (front - spec.pillar, -0.2), (front - spec.pillar, 0.06), (-1.0, 0.06)])
    sheet.stamp(_unrolled(cabin, cowl, rise), "trim", finest_m=0.2)
    for left, right, low, high, radius in pane:
        if right - left < 0.15:
            continue
        corners = [(left, low * rise), (right, low * rise), (right, high * rise), (left, high * rise)]
        for material, grow in (("trim", 0.018), ("glass", 0.0)):
            sheet.stamp(_unrolled(cabin, rounded(corners, radius, grow), rise), material, finest_m=0.025)
    beside: Field = lambda p, q: np.maximum(0.3 - p[:, 1], np.abs(q[:, 0] - np.mean(cabin.corners)) - 0.3)  # noqa: E731
    for x, width in spec.glass_posts:
        _band(sheet, x - width / 2, x + width / 2, "trim", beside, ("glass",))
    if spec.blind_sides:
        _band(sheet, *spec.blind_sides, "paint", beside, ("glass", "trim"))


def side_lines(spec: CarSpec, cabin: Shell) -> tuple[Points, ...]:
    """Returns all shut lines of the side view: those of the specification, and those of the doors around the
    windows.
    """
    if spec.door_rear is None:
        return spec.lines_side
    front, rear = cabin.along(np.array(cabin.corners))
    left, right = front + spec.side_glass[0] - _BESIDE_GLASS_M, rear - spec.side_glass[1] + _BESIDE_GLASS_M
    high, radius = spec.side_v[1] * spec.rise + _BESIDE_GLASS_M, 0.07
    outline = box(left, -1, right, high).buffer(-radius).buffer(radius, quad_segs=3).exterior.segmentize(0.15)
    over = line_merge(outline.intersection(box(left - 1, 0.02 * spec.rise, right + 1, high + 1)))
    ring = np.asarray(over.coords)
    ring = ring if ring[0, 0] < ring[-1, 0] else ring[::-1]
    u = np.linspace(0, 1, 601)
    params = np.column_stack([np.interp(ring[:, 0], cabin.along(u), u), ring[:, 1] / spec.rise])
    frame = cabin.side.patch.evaluate(params)[:, [0, 2]]
    frame = frame[frame[:, 0] > spec.door_rear]
    end = frame[-1] - [0, 0.05]
    return (*spec.lines_side, tuple((float(x), float(z)) for x, z in [*frame, end]))


def _band(sheet: Sheet, low_x: float, high_x: float, material: str, where: Field, on: tuple[str, ...]) -> None:
    """Names all faces between two x positions; both lines are cut first, because the band may be narrower than
    a face.
    """
    for x in (low_x, high_x):
        sheet.cut(_offset(0, x), where=where, on=on)
    middle, half = (low_x + high_x) / 2, (high_x - low_x) / 2
    sheet.stamp(lambda p, q: np.abs(p[:, 0] - middle) - half, material, where=where, on=on, finest_m=9.0)


def _offset(axis: int, value: float) -> Field:
    return lambda p, q: p[:, axis] - value


def _unrolled(cabin: Shell, shape: Shape, rise: float) -> Field:
    return lambda p, q: shape(np.stack([cabin.along(q[:, 0]), q[:, 1] * rise], axis=1))


def _hide_under(cabin: Shell, body: Shell) -> None:
    """Removes the part of the upper surface of the body that lies below the cabin."""
    u = np.linspace(0, 1, 81)
    ring = cabin.side.patch.evaluate(np.column_stack([u, np.full_like(u, 0.0)]))[:, :2]
    inside = rounded(np.concatenate([ring, ring[::-1] * [1, -1]]), 0.0, -0.05)
    middle = body.top.points[body.top.faces]
    corners = (inside(middle.reshape(-1, 3)[:, :2]) < 0).reshape(-1, 3)
    hidden: list[bool] = np.all(corners, axis=1).tolist()
    body.top.material = ["hidden" if h else m for h, m in zip(hidden, body.top.material, strict=True)]


def _cut_bed(bed: tuple[float, float, float], body: Shell) -> None:
    rear, front, half = bed
    shape = rounded([(rear, -half), (front, -half), (front, half), (rear, half)], 0.04)
    body.top.stamp(lambda p, q: shape(p[:, :2]), "bed", on=("paint",), finest_m=0.06)


def _sink_bed(body: Shell, parts: Parts) -> None:
    depth = 0.24
    parts.add("trim", flat(body.top.part("bed", depth), DETAILS["plastic"]), both_sides=True)
    parts.add("trim", flat(body.top.walls("bed", depth), DETAILS["plastic"]), both_sides=True)


def _wheels(spec: CarSpec, parts: Parts) -> None:
    wheel = make_wheel(spec.wheel)
    for x in spec.axles:
        at = (x, spec.track / 2, spec.wheel.radius)
        parts.add("tyre", wheel.tyre.translated(*at), both_sides=True)
        parts.add("rim", wheel.rim.translated(*at), both_sides=True)
        parts.add("trim", flat(wheel.drum.translated(*at), DETAILS["gloss"]), both_sides=True)
