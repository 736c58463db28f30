"""Windows, doors, shop fronts and balconies set into a facade."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from authoring.kit.facade import Facade, Opening
from authoring.materials.atlas import (
    AWNING_COUNT,
    LOBBY_PANES,
    WINDOW_COLUMNS,
    awning_rows,
    blade_rect,
    door_rect,
    fascia_rect,
    shop_rect,
    window_rect,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowStyle:
    """The windows of an architectural style.

    Attributes:
        kind: row of the window atlas.
        width_m, height_m: size of the opening, metres.
        sill_m: height of the sill above the floor, metres.
        recess_m: distance of the glass behind the face of the wall, metres.
        reveal: material of the cheeks.
        surround: material of a frame on the wall around the opening; None for no frame.
        lintel: material of a beam above the opening; None for no beam.
        ledge: swatch of the sill; None for no sill.
        shutters: swatch of open shutters beside the opening; None for no shutters.
    """

    kind: str
    width_m: float
    height_m: float
    sill_m: float
    recess_m: float = 0.18
    reveal: str = "plaster_white"
    surround: str | None = None
    lintel: str | None = None
    ledge: str | None = "limestone"
    shutters: str | None = None


def window(facade: Facade, opening: Opening, style: WindowStyle, *, rng: np.random.Generator) -> None:
    """Adds one window: cheeks, pane, sill, and the frame, beam and shutters of its style."""
    o = opening
    facade.reveal(style.reveal, o, style.recess_m, skip="s" if style.ledge else "")
    rect = window_rect(style.kind, int(rng.integers(WINDOW_COLUMNS)))
    tilt = (float(rng.normal(0, 0.012)), float(rng.normal(0, 0.02)))
    facade.picture("windows", rect, o.u0, o.v0, o.u1, o.v1, d_m=-style.recess_m, tilt=tilt)
    if style.ledge:
        facade.box(
            style.ledge, (o.u0 - 0.06, o.u1 + 0.06), (o.v0 - 0.09, o.v0 + 0.01), (-style.recess_m, 0.07), skip="b"
        )
    if style.lintel:
        facade.box(style.lintel, (o.u0 - 0.14, o.u1 + 0.14), (o.v1, o.v1 + 0.24), (0.0, 0.025), skip="b")
    if style.surround:
        edge, proud = 0.16, 0.045
        for u in ((o.u0 - edge, o.u0), (o.u1, o.u1 + edge)):
            facade.box(style.surround, u, (o.v0, o.v1), (0.0, proud), skip="but")
        facade.box(style.surround, (o.u0 - edge, o.u1 + edge), (o.v1, o.v1 + edge), (0.0, proud), skip="b")
    if style.shutters:
        leaf = (o.u1 - o.u0) / 2
        for u in ((o.u0 - leaf - 0.03, o.u0 - 0.03), (o.u1 + 0.03, o.u1 + leaf + 0.03)):
            facade.box(style.shutters, u, (o.v0, o.v1), (0.0, 0.05), skip="b")


def door(facade: Facade, opening: Opening, name: str, *, surround: str, recess_m: float = 0.35) -> None:
    """Adds an entrance: a recessed door, a frame, a step, and a small canopy above a glass door."""
    o = opening
    facade.reveal(surround, o, recess_m)
    facade.picture("shop_fronts", door_rect(name), o.u0, o.v0, o.u1, o.v1, d_m=-recess_m)
    edge = 0.18
    for u in ((o.u0 - edge, o.u0), (o.u1, o.u1 + edge)):
        facade.box(surround, u, (o.v0, o.v1), (0.0, 0.06), skip="bu")
    facade.box(surround, (o.u0 - edge, o.u1 + edge), (o.v1, o.v1 + 0.24), (0.0, 0.09))
    facade.box("concrete_light", (o.u0 - 0.1, o.u1 + 0.1), (0.0, 0.14), (-recess_m, 0.3), skip="bu")
    if name.startswith("glass"):
        facade.box("anthracite", (o.u0 - 0.5, o.u1 + 0.5), (o.v1 + 0.26, o.v1 + 0.36), (0.0, 1.3))


def shop_front(
    facade: Facade,
    u0: float,
    u1: float,
    height_m: float,
    *,
    frame: str,
    sign: int,
    awning: int | None,
    rng: np.random.Generator,
) -> Opening:
    """Adds the front of a shop between two piers: stall riser, windows, door, fascia with a sign, awning or blade sign.

    Returns:
        The opening that the wall must leave.
    """
    fascia_m, riser_m, recess_m = 0.62, 0.45, 0.22
    top = height_m - fascia_m
    hole = Opening(u0, 0.0, u1, height_m)
    door_w = 1.05
    door_left = bool(rng.random() < 0.5)
    door_u = u0 + 0.1 if door_left else u1 - 0.1 - door_w
    panes_u = (door_u + door_w, u1) if door_left else (u0, door_u)
    facade.reveal(frame, Opening(u0, 0.0, u1, top), recess_m)
    facade.box(frame, (panes_u[0], panes_u[1]), (0.0, riser_m), (-recess_m, -0.06), skip="bu")
    count = max(1, round((panes_u[1] - panes_u[0]) / 2.2))
    step = (panes_u[1] - panes_u[0]) / count
    for index in range(count):
        left = panes_u[0] + index * step
        rect = shop_rect(int(rng.integers(LOBBY_PANES[0])))
        facade.picture("shop_fronts", rect, left, riser_m, left + step, top, d_m=-recess_m + 0.04)
        facade.box(frame, (left - 0.05, left + 0.05), (riser_m, top), (-recess_m + 0.04, -0.04), skip="but")
    door_d = -recess_m - 0.5
    porch = Opening(door_u, 0.0, door_u + door_w, top)
    facade.picture("shop_fronts", door_rect("glass"), porch.u0, 0.0, porch.u1, 2.25, d_m=door_d)
    facade.swatch("dark_glass", porch.u0, 2.25, porch.u1, top, d_m=door_d)
    deep = Facade(facade.sink, facade.at(0.0, 0.0, -recess_m), facade.right, facade.width_m)
    deep.reveal(frame, porch, 0.5)
    side = u0 if door_left else u1 - 0.1
    facade.box(frame, (side, side + 0.1), (0.0, top), (-recess_m, -0.02), skip="but")
    facade.box(frame, (u0, u1), (top, height_m), (0.0, 0.12))
    # A sign is eight times as wide as high; what is left of the fascia keeps the frame's colour.
    wide = min(u1 - u0 - 0.16, 8 * (fascia_m - 0.14))
    middle_u, middle_v = (u0 + u1) / 2, (top + height_m) / 2
    left, low = middle_u - wide / 2, middle_v - wide / 16
    facade.picture("signs", fascia_rect(sign), left, low, left + wide, low + wide / 8, d_m=0.125)
    if awning is not None:
        _awning(facade, u0 + 0.05, u1 - 0.05, top + 0.02, awning)
    elif rng.random() < 0.5:
        blade = (u0 + 0.25, height_m + 0.55)
        facade.box("black_paint", (blade[0] - 0.02, blade[0] + 0.02), (blade[1] + 0.6, blade[1] + 0.64), (0.0, 0.95))
        _blade(facade, blade[0], blade[1], sign)
    return hole


def balcony(facade: Facade, u0: float, u1: float, v: float, depth_m: float, *, railing: str, slab: str) -> None:
    """Adds a slab with a railing: `bars`, `glass` or `solid`."""
    facade.box(slab, (u0, u1), (v - 0.18, v), (0.0, depth_m), skip="b")
    height, d0, d1 = 1.05, depth_m - 0.06, depth_m - 0.02
    if railing == "solid":
        facade.box(slab, (u0, u1), (v, v + height), (depth_m - 0.12, depth_m), skip="u")
        for u in ((u0, u0 + 0.12), (u1 - 0.12, u1)):
            facade.box(slab, u, (v, v + height), (0.0, depth_m - 0.12), skip="buf")
        return
    facade.box("anthracite", (u0, u1), (v + height - 0.05, v + height), (d0 - 0.01, d1 + 0.01), skip="")
    for u in ((u0, u0 + 0.04), (u1 - 0.04, u1)):
        facade.box("anthracite", u, (v + height - 0.05, v + height), (0.0, d0), skip="b")
    if railing == "glass":
        facade.box("grey_glass", (u0 + 0.03, u1 - 0.03), (v + 0.06, v + height - 0.05), (d0 + 0.01, d1 - 0.01), skip="")
        for u in ((u0 + 0.01, u0 + 0.03), (u1 - 0.03, u1 - 0.01)):
            facade.box("grey_glass", u, (v + 0.06, v + height - 0.05), (0.0, d0), skip="but")
        return
    facade.box("anthracite", (u0, u1), (v + 0.08, v + 0.11), (d0, d1), skip="lr")
    bars = max(4, int((u1 - u0) / 0.14))
    for u in np.linspace(u0 + 0.02, u1 - 0.02, bars):
        _bar(facade, u, d0 + 0.01, v, v + height - 0.05)
    for d in np.linspace(0.1, d0 - 0.1, max(2, int(depth_m / 0.14))):
        for end in (u0 + 0.02, u1 - 0.02):
            _bar(facade, end, d, v, v + height - 0.05)


def _bar(facade: Facade, u: float, d: float, v0: float, v1: float) -> None:
    """Adds a square bar with an edge towards the street; two faces are visible, and a flat front would need three."""
    half = 0.0127
    left, tip, right = ((u - half, d), (u, d + half), (u + half, d))
    for (ua, da), (ub, db) in ((left, tip), (tip, right)):
        corners = (facade.at(ua, v0, da), facade.at(ub, v0, db), facade.at(ub, v1, db), facade.at(ua, v1, da))
        facade.surface("anthracite", corners)


def _awning(facade: Facade, u0: float, u1: float, v: float, index: int) -> None:
    low, high = awning_rows(index % AWNING_COUNT)
    out, drop, valance = 1.15, 0.55, 0.22
    stripes = (u1 - u0) / 2.4
    top = [facade.at(u0, v - drop, out), facade.at(u1, v - drop, out), facade.at(u1, v, 0.03), facade.at(u0, v, 0.03)]
    mid = low + 0.25 * (high - low)
    uvs = [(0.0, mid), (stripes, mid), (stripes, high), (0.0, high)]
    facade.sink.polygon("awnings", top, uvs)
    facade.sink.polygon("awnings", [p - (0, 0, 0.015) for p in top[::-1]], uvs[::-1])
    fringe = [
        facade.at(u0, v - drop - valance, out),
        facade.at(u1, v - drop - valance, out),
        facade.at(u1, v - drop, out),
        facade.at(u0, v - drop, out),
    ]
    uvs = [(0.0, low), (stripes, low), (stripes, mid), (0.0, mid)]
    facade.sink.polygon("awnings", fringe, uvs)
    facade.sink.polygon("awnings", [p - facade.outward * 0.012 for p in fringe[::-1]], uvs[::-1])
    for u, order in ((u0, 1), (u1, -1)):
        side = [facade.at(u, v - drop, 0.03), facade.at(u, v - drop, out), facade.at(u, v, 0.03)]
        facade.sink.polygon("awnings", side[::order], [(0.0, mid), (0.3, mid), (0.0, high)][::order])


def _blade(facade: Facade, u: float, v: float, index: int) -> None:
    u0, v0, u1, v1 = blade_rect(index)
    for offset, order in ((0.03, 1), (-0.03, -1)):
        d0, d1 = (0.25, 0.85) if order == 1 else (0.85, 0.25)
        corners = [
            facade.at(u + offset, v, d1),
            facade.at(u + offset, v, d0),
            facade.at(u + offset, v + 0.6, d0),
            facade.at(u + offset, v + 0.6, d1),
        ]
        facade.sink.polygon("signs", corners, [(u0, v0), (u1, v0), (u1, v1), (u0, v1)])
    facade.box("black_paint", (u - 0.03, u + 0.03), (v - 0.02, v), (0.25, 0.85), skip="")
    facade.box("black_paint", (u - 0.03, u + 0.03), (v + 0.6, v + 0.62), (0.25, 0.85), skip="")
    facade.box("black_paint", (u - 0.03, u + 0.03), (v, v + 0.6), (0.84, 0.86), skip="but")
