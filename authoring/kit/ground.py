"""Ground floors: homes with an entrance, shops, office lobbies, loading docks."""

from __future__ import annotations

import numpy as np

from authoring.kit.facade import Facade, Opening
from authoring.kit.openings import door, shop_front, window
from authoring.kit.styles import Style
from authoring.materials.atlas import AWNING_COUNT, FASCIA_COUNT, LOBBY_PANES, door_rect, shop_rect

FRAMES = (
    "anthracite",
    "dark_green",
    "dark_blue",
    "dark_red",
    "teal_paint",
    "black_paint",
    "cream_paint",
    "brown_paint",
)


def ground_floor(facade: Facade, style: Style, *, main: bool, rng: np.random.Generator) -> list[Opening]:
    """Adds everything at street level, and returns the openings that the wall must leave."""
    makers = {"homes": _homes, "shops": _shops, "lobby": _lobby, "dock": _dock}
    return makers[style.ground](facade, style, main, rng)


def _homes(facade: Facade, style: Style, main: bool, rng: np.random.Generator) -> list[Opening]:
    width = facade.width_m
    usable = width - 1.4
    count = max(1, int(usable / style.bay_m))
    pitch = usable / count
    entrance = int(rng.integers(count)) if main else -1
    holes = []
    half = min(style.window.width_m, pitch - 0.5) / 2
    for index in range(count):
        centre = 0.7 + (index + 0.5) * pitch
        if index == entrance:
            hole = Opening(centre - 0.65, 0.0, centre + 0.65, 2.75)
            door(facade, hole, style.door, surround=style.trim)
        else:
            low = 1.1
            hole = Opening(centre - half, low, centre + half, min(low + style.window.height_m, style.ground_m - 0.6))
            window(facade, hole, style.window, rng=rng)
        holes.append(hole)
    _plinth(facade, holes, style)
    return holes


def _shops(facade: Facade, style: Style, main: bool, rng: np.random.Generator) -> list[Opening]:
    width = facade.width_m
    top = min(3.6, style.ground_m - 0.35)
    entrance_m = 2.0 if main and width > 11 else 0.0
    count = max(1, round((width - entrance_m - 0.8) / float(rng.uniform(4.6, 6.4))))
    pitch = (width - entrance_m - 0.8) / count
    slot = int(rng.integers(count + 1)) if entrance_m else -1
    holes = []
    u = 0.4
    for index in range(count + 1):
        if index == slot:
            hole = Opening(u + 0.4, 0.0, u + 1.6, 2.6)
            door(facade, hole, style.door, surround=style.trim)
            holes.append(hole)
            u += entrance_m
        if index < count:
            awning = int(rng.integers(AWNING_COUNT)) if rng.random() < 0.5 else None
            holes.append(
                shop_front(
                    facade,
                    u + 0.22,
                    u + pitch - 0.22,
                    top,
                    frame=str(rng.choice(FRAMES)),
                    sign=int(rng.integers(FASCIA_COUNT)),
                    awning=awning,
                    rng=rng,
                )
            )
            u += pitch
    return holes


def _lobby(facade: Facade, style: Style, main: bool, rng: np.random.Generator) -> list[Opening]:
    width = facade.width_m
    count = max(2, int((width - 0.8) / 3.4))
    pitch = (width - 0.8) / count
    entrance = count // 2 if main else -1
    holes = []
    for index in range(count):
        u0, u1 = 0.4 + index * pitch + 0.2, 0.4 + (index + 1) * pitch - 0.2
        top = style.ground_m - 0.7
        hole = Opening(u0, 0.0 if index == entrance else 0.25, u1, top)
        facade.reveal("anthracite", hole, 0.5)
        rect = door_rect("glass_double") if index == entrance else shop_rect(int(rng.choice(LOBBY_PANES)))
        facade.picture("shop_fronts", rect, hole.u0, hole.v0, hole.u1, hole.v1, d_m=-0.5)
        holes.append(hole)
        if index == entrance:
            facade.box("anthracite", (u0 - 0.6, u1 + 0.6), (top + 0.05, top + 0.27), (0.0, 2.2), skip="b")
            for u in (u0 - 0.45, u1 + 0.33):
                facade.box("steel", (u, u + 0.12), (0.0, top + 0.05), (1.9, 2.02), skip="ut")
    return holes


def _dock(facade: Facade, style: Style, main: bool, rng: np.random.Generator) -> list[Opening]:
    width = facade.width_m
    usable = width - 1.4
    count = max(1, int(usable / style.bay_m))
    pitch = usable / count
    holes = []
    gates = rng.random(count) < 0.45
    for index in range(count):
        centre = 0.7 + (index + 0.5) * pitch
        half = min(style.window.width_m, pitch - 0.6) / 2
        if main and index == count // 2:
            hole = Opening(centre - 0.75, 0.0, centre + 0.75, 2.7)
            door(facade, hole, style.door, surround="concrete_light")
        elif gates[index]:
            hole = Opening(centre - half, 0.0, centre + half, 3.3)
            facade.reveal("concrete_light", hole, 0.35, skip="s")
            facade.picture("shop_fronts", door_rect("shutter"), hole.u0, 0.0, hole.u1, hole.v1, d_m=-0.35)
            facade.box("steel", (hole.u0 - 0.2, hole.u1 + 0.2), (3.3, 3.55), (0.0, 0.05))
            for u in (hole.u0 - 0.12, hole.u1):
                facade.box("signal_yellow", (u, u + 0.12), (0.0, 1.0), (0.0, 0.12), skip="bu")
        else:
            hole = Opening(centre - half, 1.2, centre + half, min(1.2 + style.window.height_m, style.ground_m - 0.6))
            window(facade, hole, style.window, rng=rng)
        holes.append(hole)
    if main and gates.any():
        facade.box("rust", (0.5, width - 0.5), (3.85, 3.98), (0.0, 1.9), skip="b")
        for u in np.linspace(0.7, width - 0.7, max(2, int(width / 4))):
            facade.box("rust", (u - 0.04, u + 0.04), (3.98, 4.06), (0.0, 1.9), skip="b")
    return holes


def _plinth(facade: Facade, holes: list[Opening], style: Style) -> None:
    u = 0.0
    for hole in [*sorted((h for h in holes if h.v0 < 0.1), key=lambda h: h.u0), None]:
        end = facade.width_m if hole is None else hole.u0 - 0.2
        if end > u:
            facade.box(style.trim, (u, end), (0.0, 0.55), (0.0, 0.05), skip="bu")
        u = hole.u1 + 0.2 if hole else u
