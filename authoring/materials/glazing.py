"""Windows, shop fronts, doors and the curtain wall: opaque pictures of glass that shine like glass."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from authoring.materials.atlas import DOORS, SHOP_COUNT, WINDOW_COLUMNS, WINDOW_ROWS
from authoring.materials.canvas import Canvas, Colour, tiled
from authoring.materials.image import Image, normal_from_slopes

Array = npt.NDArray[np.float64]
Textures = dict[str, Image]
# Glass is drawn as a smooth, dark, half-metallic surface: its reflectance at right angles is that of double glazing.
GLASS = {"roughness": 0.06, "metallic": 0.85}
BEHIND = {"roughness": 0.09, "metallic": 0.10}
# What is smoother than this is glass.
GLASS_BELOW = 0.12
# Nominal width and height of what an atlas's cells show.
WINDOW_M, SHOP_M, DOOR_M = (1.2, 1.8), (2.2, 2.4), (1.2, 2.3)


def windows(*, rng: np.random.Generator) -> Textures:
    """Four kinds of window, each with eight dressings."""
    cells = []
    for kind in WINDOW_ROWS:
        for dressing in range(WINDOW_COLUMNS):
            cell = Canvas(128, 256)
            _glass(cell, dressing, rng=rng)
            _frame(cell, kind, dressing)
            cells.append(cell)
    return _atlas("windows", cells, WINDOW_COLUMNS, WINDOW_M, rng=rng)


def shop_fronts(*, rng: np.random.Generator) -> Textures:
    """Twelve shop windows with something to see behind them, and eight doors."""
    shops = []
    for index in range(SHOP_COUNT):
        cell = Canvas(256, 256)
        _shop(cell, index, rng=rng)
        shops.append(cell)
    doors = []
    for name in DOORS:
        cell = Canvas(128, 256)
        _door(cell, name)
        doors.append(cell)
    upper = _atlas("shop_fronts", shops, 4, SHOP_M, rng=rng)
    lower = _atlas("shop_fronts", doors, 8, DOOR_M, rng=rng)
    return {stem: np.concatenate([upper[stem], lower[stem]], axis=0) for stem in upper}


def curtain_wall(*, rng: np.random.Generator) -> Textures:
    """Eight panes by four storeys of tinted glass over spandrels; each pane a little out of plane."""
    size, panes, storeys = 1024, 8, 4
    wall = Canvas(size, size)
    tilt = np.zeros((size, size, 2))
    for storey in range(storeys):
        for pane in range(panes):
            x0, x1 = pane / panes, (pane + 1) / panes
            y0, y1 = storey / storeys, (storey + 1) / storeys
            split = y1 - 0.26 / storeys
            tone = float(rng.uniform(0.85, 1.15))
            wall.rect(x0, y0, x1, split, np.array([0.105, 0.135, 0.15]) * tone, roughness=0.05, metallic=0.95)
            if rng.random() < 0.3:
                drop = y0 + (split - y0) * float(rng.choice([0.3, 0.55, 1.0]))
                wall.rect(x0, y0, x1, drop, np.array([0.20, 0.205, 0.20]) * tone, roughness=0.08, metallic=0.45)
            wall.rect(x0, split, x1, y1, np.array([0.062, 0.075, 0.082]) * tone, roughness=0.22, metallic=0.5)
            wall.rect(x0, split - 0.004, x1, split + 0.004, (0.03, 0.03, 0.032), roughness=0.5)
            rows = slice(round(y0 * size), round(y1 * size))
            tilt[rows, round(x0 * size) : round(x1 * size)] = 0.012 * rng.integers(-1, 2, 2)
    for pane in range(panes + 1):
        wall.rect(pane / panes - 0.003, 0, pane / panes + 0.003, 1, (0.03, 0.03, 0.032), roughness=0.5)
    return {
        "curtain_wall": wall.image(),
        "curtain_wall_orm": wall.orm(),
        "curtain_wall_n": normal_from_slopes(tilt[..., 0], tilt[..., 1]),
    }


def _atlas(
    stem: str, cells: list[Canvas], columns: int, size_m: tuple[float, float], *, rng: np.random.Generator
) -> Textures:
    """Colour, ORM and normals of cells that show `size_m` each."""
    normals = [cell.normal(size_m, lean=_askew(cell, rng=rng)) for cell in cells]
    return {
        stem: tiled([c.image() for c in cells], columns),
        f"{stem}_orm": tiled([c.orm() for c in cells], columns),
        f"{stem}_n": tiled(normals, columns),
    }


def _askew(cell: Canvas, *, rng: np.random.Generator) -> Array:
    """Slopes (height, width, 2) of the panes: each sits a little askew in its frame and mirrors something else.

    The same all over a pane: where a byte's steps of half a degree followed a wave, reflections would show creases.
    """
    # Shadows on the glass are as smooth, and cross the bars that cast them.
    is_glass = (cell.finished_surface()[..., 0] < GLASS_BELOW) & (cell.finished_relief_m() <= 0)
    glass = is_glass.astype(np.uint8)
    count, pane = cv2.connectedComponents(glass, connectivity=4)
    slopes = rng.normal(0, 0.011, (count, 2)).clip(-0.022, 0.022)
    return np.asarray(slopes[pane] * glass[..., None])


def _glass(cell: Canvas, dressing: int, *, rng: np.random.Generator) -> None:
    """The pane and what hangs behind it."""
    cell.fill((0.09, 0.10, 0.105), **GLASS)
    cell.gradient(0, 0, 1, 1, (0.075, 0.085, 0.092), (0.105, 0.112, 0.115))
    white: Colour = (0.42, 0.40, 0.36)
    if dressing in (1, 6):
        tone: Colour = white if dressing == 1 else (0.30, 0.16, 0.09)
        reach = 0.26 if dressing == 1 else 0.36
        for left, right in ((0.0, reach), (1 - reach, 1.0)):
            _folds(cell, left, 0.0, right, 1.0, tone, rng=rng)
    elif dressing == 2:
        cell.rect(0, 0, 1, 0.46, np.asarray(white) * 0.95, **BEHIND)
        cell.rect(0, 0.445, 1, 0.46, np.asarray(white) * 0.6, **BEHIND)
    elif dressing == 3:
        _folds(cell, 0, 0, 1, 1, (0.26, 0.26, 0.25), rng=rng)
    elif dressing == 4:
        for y in np.arange(0.02, 0.98, 0.03):
            cell.rect(0, y, 1, y + 0.02, (0.30, 0.295, 0.28), **BEHIND)
    elif dressing == 5:
        cell.gradient(0, 0, 1, 1, (0.10, 0.085, 0.06), (0.16, 0.12, 0.07))
        cell.ellipse(0.34, 0.36, 0.13, 0.05, (0.62, 0.44, 0.20), **BEHIND)
        cell.rect(0.62, 0.45, 0.85, 0.72, (0.10, 0.06, 0.04), **BEHIND)
    elif dressing == 7:
        cell.rect(0, 0, 1, 0.24, np.asarray(white) * 0.8, **BEHIND)
        for x in (0.2, 0.5, 0.78):
            cell.ellipse(x, 0.97, 0.09, 0.05, (0.03, 0.07, 0.025), **BEHIND)
            cell.ellipse(x + 0.03, 0.92, 0.05, 0.035, (0.04, 0.10, 0.03), **BEHIND)


def _folds(cell: Canvas, x0: float, y0: float, x1: float, y1: float, tone: Colour, *, rng: np.random.Generator) -> None:
    x = x0
    while x < x1 - 1e-6:
        step = min(float(rng.uniform(0.03, 0.06)), x1 - x)
        cell.rect(x, y0, x + step, y1, np.asarray(tone) * float(rng.uniform(0.7, 1.05)), **BEHIND)
        x += step


def _frame(cell: Canvas, kind: str, dressing: int) -> None:
    """Sash bars and the frame's shadow on the glass."""
    colours = {
        "casement": (0.60, 0.59, 0.56),
        "sash": (0.52, 0.50, 0.45),
        "modern": (0.045, 0.047, 0.05),
        "industrial": (0.03, 0.032, 0.034),
    }
    colour = colours[kind]
    side = 0.075 if kind != "modern" else 0.05
    bars = {
        "casement": ([0.5], [0.30]),
        "sash": ([0.5], [0.5]),
        "modern": ([0.36], []),
        "industrial": ([0.25, 0.5, 0.75], [0.2, 0.4, 0.6, 0.8]),
    }[kind]
    shadow = 0.02
    cell.shade(side, side / 2, 1 - side, side / 2 + shadow * 2, 0.45)
    cell.shade(side, side / 2, side + shadow * 1.5, 1, 0.7)
    thick = {"casement": 0.07, "sash": 0.045, "modern": 0.05, "industrial": 0.026}[kind]
    for x in bars[0]:
        cell.rect(x + thick / 2, 0, x + thick / 2 + shadow, 1, (0.02, 0.022, 0.022), roughness=0.1)
        cell.rect(x - thick / 2, 0, x + thick / 2, 1, colour, roughness=0.55, height_m=0.016)
    for y in bars[1]:
        half = thick / 4 if kind != "sash" else 0.016
        cell.rect(0, y + half, 1, y + half + shadow / 2, (0.02, 0.022, 0.022), roughness=0.1)
        cell.rect(0, y - half, 1, y + half, colour, roughness=0.55, height_m=0.014)
    for x0, y0, x1, y1 in ((0, 0, side, 1), (1 - side, 0, 1, 1), (0, 0, 1, side / 2), (0, 1 - side / 2, 1, 1)):
        cell.rect(x0, y0, x1, y1, colour, roughness=0.55, height_m=0.022)
    cell.rect(0, 0, 1, 0.008, np.asarray(colour) * 0.5, roughness=0.6)
    cell.relief_m[-round(side / 4 * cell.size[1]) :] += 0.012  # the sill's nose
    if kind == "casement":
        cell.rect(0.485, 0.55, 0.515, 0.6, (0.3, 0.28, 0.24), roughness=0.4, metallic=0.8, height_m=0.03)


def _shop(cell: Canvas, index: int, *, rng: np.random.Generator) -> None:
    """A lit room behind glass: shelves, dummies, cafe tables, posters; the last four are lobbies."""
    wall = np.array([(0.20, 0.17, 0.13), (0.15, 0.16, 0.17), (0.22, 0.20, 0.17), (0.12, 0.10, 0.09)][index % 4])
    cell.fill(wall, **BEHIND)
    cell.gradient(0, 0, 1, 0.8, wall * 1.15, wall * 0.6)
    cell.gradient(0, 0.8, 1, 1, wall * 0.55, wall * 0.3)
    for x in np.linspace(0.12, 0.88, 5):
        cell.ellipse(x, 0.07, 0.035, 0.012, (0.75, 0.68, 0.52), **BEHIND)
    if index >= 8:
        _lobby(cell, index - 8)
    elif index % 4 == 0:
        for y in np.arange(0.22, 0.95, 0.145):
            _goods(cell, 0.04, 0.96, y, 0.11, rng=rng)
            cell.rect(0.03, y, 0.97, y + 0.014, wall * 0.35, **BEHIND)
    elif index % 4 == 1:
        for x in np.arange(0.16, 0.95, 0.23):
            _dummy(cell, float(x), rng=rng)
        cell.rect(0, 0.93, 1, 1, (0.30, 0.28, 0.25), **BEHIND)
    elif index % 4 == 2:
        for x in (0.2, 0.55, 0.85):
            cell.rect(x - 0.09, 0.7, x + 0.09, 0.72, (0.22, 0.13, 0.07), **BEHIND)
            cell.rect(x - 0.01, 0.72, x + 0.01, 0.95, (0.04, 0.04, 0.04), **BEHIND)
            cell.line([(x, 0.0), (x, 0.25)], 0.006, (0.03, 0.03, 0.03))
            cell.ellipse(x, 0.28, 0.05, 0.035, (0.72, 0.55, 0.28), **BEHIND)
        _goods(cell, 0.05, 0.95, 0.5, 0.07, rng=rng)
        cell.rect(0.03, 0.5, 0.97, 0.512, (0.08, 0.05, 0.03), **BEHIND)
    else:
        for x in (0.06, 0.38, 0.70):
            tone = _muted(rng)
            cell.rect(x, 0.2, x + 0.24, 0.66, tone, **BEHIND)
            cell.ellipse(x + 0.12, 0.38, 0.08, 0.08, np.clip(tone[::-1] * 1.3, 0, 0.65), **BEHIND)
            cell.rect(x + 0.03, 0.54, x + 0.21, 0.57, (0.6, 0.58, 0.54), **BEHIND)
        _goods(cell, 0.04, 0.96, 0.95, 0.16, rng=rng)
    # The upper edge lies in the fascia's shadow.
    cell.shade(0, 0, 1, 0.03, 0.35)


def _lobby(cell: Canvas, index: int) -> None:
    """A dim entrance hall behind reflecting glass: columns, a ceiling's lights, a desk, a plant."""
    cell.fill((0.12, 0.125, 0.13), roughness=0.06, metallic=0.7)
    cell.gradient(0, 0, 1, 1, (0.13, 0.128, 0.12), (0.10, 0.10, 0.098))
    for y, x0 in ((0.10, 0.1), (0.16, 0.2), (0.205, 0.28)):
        for x in np.linspace(x0, 1 - x0, 4):
            cell.rect(x - 0.05, y, x + 0.05, y + 0.012, (0.55, 0.52, 0.44), **BEHIND)
    for x in np.linspace(0.12, 0.88, 3) + 0.02 * index:
        cell.rect(x, 0.06, x + 0.045, 0.93, (0.20, 0.195, 0.18), **BEHIND)
    if index % 2:
        cell.rect(0.34, 0.66, 0.72, 0.88, (0.16, 0.10, 0.06), **BEHIND)
        cell.rect(0.32, 0.64, 0.74, 0.67, (0.30, 0.29, 0.27), **BEHIND)
    else:
        cell.rect(0.55, 0.78, 0.65, 0.9, (0.05, 0.05, 0.05), **BEHIND)
        for x, y in ((0.56, 0.68), (0.64, 0.66), (0.6, 0.58), (0.53, 0.6), (0.68, 0.6)):
            cell.ellipse(x, y, 0.05, 0.07, (0.03, 0.06, 0.025), **BEHIND)
    cell.gradient(0, 0.9, 1, 1, (0.12, 0.115, 0.11), (0.07, 0.07, 0.068))


def _goods(cell: Canvas, x0: float, x1: float, shelf: float, tall: float, *, rng: np.random.Generator) -> None:
    x = x0
    while x < x1 - 0.03:
        width = float(rng.uniform(0.02, 0.06))
        tone = _muted(rng) * float(rng.uniform(0.3, 0.9))
        cell.rect(x, shelf - tall * float(rng.uniform(0.45, 0.95)), min(x + width, x1), shelf, tone, **BEHIND)
        x += width + float(rng.uniform(0.0, 0.02))


def _muted(rng: np.random.Generator) -> Array:
    """A colour of goods: mostly earthy, sometimes bright."""
    tone = float(rng.uniform(0.06, 0.42)) * np.ones(3)
    return np.asarray(
        np.clip(tone + rng.normal(0, 0.05, 3) + rng.normal(0, 0.05) * np.array([1.0, 0.0, -1.0]), 0.02, 0.5)
    )


def _dummy(cell: Canvas, x: float, *, rng: np.random.Generator) -> None:
    skin, coat, legs = (0.36, 0.33, 0.29), _muted(rng) * 0.8, _muted(rng) * 0.35
    cell.ellipse(x, 0.27, 0.028, 0.038, skin, **BEHIND)
    cell.polygon([(x - 0.075, 0.34), (x + 0.075, 0.34), (x + 0.055, 0.62), (x - 0.055, 0.62)], coat, **BEHIND)
    cell.polygon([(x - 0.055, 0.62), (x + 0.055, 0.62), (x + 0.04, 0.93), (x - 0.04, 0.93)], legs, **BEHIND)
    for sign in (-1, 1):
        arm = [(x + sign * 0.075, 0.34), (x + sign * 0.105, 0.60), (x + sign * 0.085, 0.61), (x + sign * 0.055, 0.38)]
        cell.polygon(arm, np.asarray(coat) * 0.85, **BEHIND)


def _door(cell: Canvas, name: str) -> None:
    """One door with its frame."""
    if name.startswith("panel_"):
        colour = np.array(
            {
                "green": (0.02, 0.06, 0.035),
                "brown": (0.12, 0.06, 0.03),
                "blue": (0.02, 0.05, 0.12),
                "black": (0.022, 0.022, 0.024),
            }[name[6:]]
        )
        cell.fill(colour, roughness=0.35)
        cell.rect(0.06, 0.02, 0.94, 0.20, (0.09, 0.10, 0.105), height_m=-0.02, **GLASS)
        cell.rect(0, 0.2, 1, 0.215, colour * 0.4)
        for y0, y1 in ((0.26, 0.54), (0.60, 0.93)):
            for x0, x1 in ((0.12, 0.46), (0.54, 0.88)):
                cell.rect(x0, y0, x1, y1, colour * 0.45, roughness=0.4, height_m=-0.012)
                cell.rect(x0 + 0.03, y0 + 0.012, x1 - 0.015, y1 - 0.006, colour * 1.35, roughness=0.35, height_m=-0.006)
                cell.rect(x0 + 0.05, y0 + 0.025, x1 - 0.05, y1 - 0.025, colour, roughness=0.35, height_m=0.0)
        cell.ellipse(0.9, 0.57, 0.03, 0.015, (0.55, 0.42, 0.18), roughness=0.3, metallic=0.9)
        cell.rect(0.3, 0.565, 0.7, 0.58, (0.45, 0.36, 0.17), roughness=0.35, metallic=0.9, height_m=0.006)
    elif name.startswith("glass"):
        cell.fill((0.05, 0.052, 0.055), roughness=0.45, metallic=0.3)
        leaves = [(0.06, 0.94)] if name == "glass" else [(0.04, 0.485), (0.515, 0.96)]
        for x0, x1 in leaves:
            cell.rect(x0, 0.03, x1, 0.95, (0.10, 0.108, 0.112), height_m=-0.02, **GLASS)
            cell.gradient(x0, 0.03, x1, 0.95, (0.085, 0.092, 0.096), (0.13, 0.13, 0.125))
        for x in (0.82,) if name == "glass" else (0.42, 0.55):
            cell.rect(x, 0.42, x + 0.035, 0.66, (0.6, 0.6, 0.6), roughness=0.3, metallic=0.9, height_m=0.01)
    elif name == "steel":
        cell.fill((0.07, 0.075, 0.08), roughness=0.5)
        cell.rect(0.06, 0.03, 0.94, 1.0, (0.13, 0.14, 0.15), roughness=0.45, height_m=-0.015)
        cell.rect(0.08, 0.48, 0.2, 0.53, (0.5, 0.5, 0.5), roughness=0.35, metallic=0.9, height_m=0.01)
        cell.rect(0.3, 0.14, 0.7, 0.3, (0.08, 0.09, 0.09), height_m=-0.03, **GLASS)
        cell.rect(0.06, 0.93, 0.94, 1.0, (0.35, 0.35, 0.35), roughness=0.4, metallic=0.8, height_m=-0.012)
    else:
        cell.fill((0.28, 0.285, 0.29), roughness=0.5, metallic=0.3)
        # Slats of 9 cm, rounded.
        slat = (np.arange(cell.size[1]) + 0.5) / cell.size[1] / 0.04
        cell.relief_m[:] = 0.014 * np.abs(np.sin(np.pi * slat))[:, None] ** 0.7
        for y in np.arange(0.0, 1.0, 0.04):
            cell.rect(0, y, 1, y + 0.006, (0.08, 0.08, 0.085), roughness=0.7)
            cell.rect(0, y + 0.006, 1, y + 0.014, (0.36, 0.365, 0.37), roughness=0.45, metallic=0.3)
        cell.rect(0, 0.96, 1, 1, (0.05, 0.05, 0.05))
        cell.shade(0, 0, 1, 0.05, 0.5)
