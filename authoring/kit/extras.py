"""Additions to facades: downpipes, air conditioners, flower boxes, fire escapes, oriels."""

from __future__ import annotations

import itertools

import numpy as np

from authoring.kit.facade import Facade, Opening
from authoring.kit.openings import WindowStyle, window


def downpipe(facade: Facade, u: float, top_m: float, *, swatch: str = "zinc_roof") -> None:
    """Adds a rain pipe from the eaves to the ground, with brackets and a cast-iron foot."""
    half, near, far = 0.045, 0.03, 0.12
    facade.box(swatch, (u - half, u + half), (1.6, top_m), (near, far), skip="but")
    facade.box("cast_iron", (u - half - 0.01, u + half + 0.01), (0.0, 1.6), (near, far + 0.01), skip="bu")
    for v in np.arange(2.6, top_m - 0.5, 2.6):
        facade.box(
            "galvanised", (u - half - 0.02, u + half + 0.02), (float(v), float(v) + 0.04), (0.0, far + 0.012), skip="b"
        )


def air_conditioner(facade: Facade, u: float, v: float) -> None:
    """Adds the outdoor unit of an air conditioner, on brackets below a window."""
    facade.box("plastic_white", (u - 0.4, u + 0.4), (v - 0.72, v - 0.16), (0.08, 0.38), skip="")
    facade.box("anthracite", (u - 0.34, u + 0.08), (v - 0.66, v - 0.22), (0.38, 0.385), skip="b")
    facade.box("plastic_grey", (u + 0.14, u + 0.34), (v - 0.60, v - 0.30), (0.38, 0.385), skip="b")
    for side in (u - 0.3, u + 0.27):
        facade.box("galvanised", (side, side + 0.03), (v - 0.76, v - 0.72), (0.0, 0.38), skip="b")


def flower_box(facade: Facade, opening: Opening, *, rng: np.random.Generator) -> None:
    """Adds a box of flowers on a window sill."""
    u0, u1, v = opening.u0 + 0.05, opening.u1 - 0.05, opening.v0
    facade.box(
        str(rng.choice(["terracotta", "dark_green", "anthracite"])),
        (u0, u1),
        (v + 0.01, v + 0.17),
        (0.06, 0.24),
        skip="t",
    )
    facade.box("dark_green", (u0 + 0.01, u1 - 0.01), (v + 0.15, v + 0.24), (0.04, 0.25), skip="b")
    bloom = str(rng.choice(["flower_red", "flower_pink", "flower_yellow", "flower_white"]))
    for u in np.arange(u0 + 0.06, u1 - 0.04, 0.11):
        lift, out = rng.uniform(0.0, 0.08), rng.uniform(-0.03, 0.03)
        facade.box(
            bloom,
            (float(u) - 0.035, float(u) + 0.035),
            (v + 0.2 + lift, v + 0.27 + lift),
            (0.15 + out, 0.22 + out),
            skip="bu",
        )


def fire_escape(facade: Facade, u0: float, u1: float, levels_m: list[float]) -> None:
    """Adds a fire escape: iron platforms at each level, steep stairs between them, and a ladder that ends above the
    heads of people.
    """
    iron, deep = "black_paint", 1.05
    for index, level in enumerate(levels_m):
        facade.box(iron, (u0, u1), (level - 0.06, level), (0.0, deep), skip="b")
        for v in (level + 0.5, level + 0.95):
            facade.box(iron, (u0, u1), (v, v + 0.03), (deep - 0.03, deep), skip="lr")
            for u in (u0, u1 - 0.03):
                facade.box(iron, (u, u + 0.03), (v, v + 0.03), (0.0, deep - 0.03), skip="bf")
        for u in np.linspace(u0, u1 - 0.03, 5):
            facade.box(iron, (float(u), float(u) + 0.03), (level, level + 0.95), (deep - 0.03, deep), skip="ut")
        if index + 1 < len(levels_m):
            _stair(facade, u0 + 0.5, u1 - 0.5, level, levels_m[index + 1], iron, mirrored=index % 2 == 1)
    low = levels_m[0] - 1.4
    for u in (u0 + 0.3, u0 + 0.7):
        facade.box(iron, (u, u + 0.03), (low, levels_m[0] + 0.9), (deep + 0.0, deep + 0.03), skip="")
    for v in np.arange(low + 0.1, levels_m[0], 0.3):
        facade.box(iron, (u0 + 0.33, u0 + 0.7), (float(v), float(v) + 0.025), (deep, deep + 0.025), skip="lr")


def oriel(
    facade: Facade,
    centre_m: float,
    width_m: float,
    levels_m: list[float],
    floor_m: float,
    *,
    wall: str,
    trim: str,
    style: WindowStyle,
    rng: np.random.Generator,
) -> None:
    """Adds a bay window with slanted cheeks through several floors, on a corbel, under a small roof."""
    out, slant = 0.65, 0.5
    left, right = centre_m - width_m / 2, centre_m + width_m / 2
    plan = [(left, 0.0), (left + slant, out), (right - slant, out), (right, 0.0)]
    base, top = levels_m[0], levels_m[-1] + floor_m - 0.25
    for (u0, d0), (u1, d1) in itertools.pairwise(plan):
        start, end = facade.at(u0, 0.0, d0), facade.at(u1, 0.0, d1)
        length = float(np.linalg.norm(end - start))
        face = Facade(facade.sink, start, (end - start) / length, length)
        half = min(style.width_m, length - 0.24) / 2
        holes = []
        for level in levels_m:
            low = level + style.sill_m
            hole = Opening(length / 2 - half, low, length / 2 + half, min(low + style.height_m, level + floor_m - 0.4))
            holes.append(hole)
            window(
                face,
                hole,
                WindowStyle(
                    kind=style.kind,
                    width_m=2 * half,
                    height_m=style.height_m,
                    sill_m=style.sill_m,
                    recess_m=0.1,
                    reveal=wall,
                    ledge=style.ledge,
                ),
                rng=rng,
            )
        face.wall(wall, 0.0, base, length, top, holes)
        for level in (base, *levels_m[1:], top - 0.08):
            face.box(trim, (-0.02, length + 0.02), (level - 0.02, level + 0.1), (0.0, 0.05))
    for level, grow, order in ((base - 0.02, 0.0, -1), (top + 0.02, 0.08, 1)):
        corners = [facade.at(u + np.sign(u - centre_m) * grow, level, d + (grow if d else 0.0)) for u, d in plan]
        peak = facade.at(centre_m, level + order * (0.5 if order < 0 else 0.45), 0.02)
        for a, b in itertools.pairwise(corners):
            ring = [a, b, peak] if order > 0 else [b, a, peak]
            facade.sink.swatch_quad("zinc_roof" if order > 0 else trim, ring)


def _stair(facade: Facade, u0: float, u1: float, low: float, high: float, swatch: str, *, mirrored: bool) -> None:
    """Adds a flight of stairs between two platforms: two stringers and treads."""
    first, last = (u1, u0) if mirrored else (u0, u1)
    steps = 9
    for index in range(steps):
        share = (index + 0.5) / steps
        u, v = first + (last - first) * share, low + (high - low) * share
        facade.box(swatch, (u - 0.12, u + 0.12), (v, v + 0.03), (0.35, 0.9), skip="lrb")
    for d in (0.33, 0.9):
        foot, head = facade.at(first, low, d), facade.at(last, high, d)
        edge = np.array([0.0, 0.0, 0.14])
        quad = [foot, head, head + edge, foot + edge]
        facade.sink.swatch_quad(swatch, quad)
        facade.sink.swatch_quad(swatch, quad[::-1])
