"""Printed things: shop signs, posters, awnings, traffic signs, signal lenses, cast iron covers."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from authoring.materials.atlas import AWNING_COUNT, IRONWORK, LENSES
from authoring.materials.canvas import Canvas, Colour, tiled
from authoring.materials.image import Image, linear_to_srgb, normal_from_height
from authoring.materials.noise import tileable_noise

Array = npt.NDArray[np.float64]
Textures = dict[str, Image]
NAMES = (
    "KAVELO", "Brunami", "ZELTO 24", "Optikum", "FLORANE", "marvek", "LIBRANO", "Teknima",
    "SALUNA", "Gustello", "VERDINA", "bikorama", "FARMAXA", "Sunoko bar", "DOLCINE", "HEMDEN & CO",
)  # fmt: skip
SIGN_COLOURS: tuple[tuple[Colour, Colour], ...] = (
    ((0.02, 0.05, 0.09), (0.68, 0.66, 0.60)),
    ((0.40, 0.03, 0.03), (0.68, 0.66, 0.60)),
    ((0.62, 0.59, 0.52), (0.04, 0.04, 0.04)),
    ((0.03, 0.12, 0.07), (0.62, 0.52, 0.22)),
    ((0.03, 0.03, 0.032), (0.66, 0.64, 0.60)),
    ((0.60, 0.36, 0.04), (0.05, 0.03, 0.02)),
    ((0.04, 0.20, 0.26), (0.68, 0.67, 0.64)),
    ((0.20, 0.05, 0.12), (0.66, 0.58, 0.50)),
)


def signs(*, rng: np.random.Generator) -> Textures:
    """Sixteen fascias, four posters, eight signs that hang over the pavement."""
    fascias = []
    for index, name in enumerate(NAMES):
        ground, ink = SIGN_COLOURS[index % len(SIGN_COLOURS)]
        cell = Canvas(512, 64)
        cell.fill(np.asarray(ground), roughness=0.5)
        cell.rect(0, 0.9, 1, 1, np.asarray(ground) * 0.6)
        middle = 0.5 if index % 3 else 0.55
        font = (cv2.FONT_HERSHEY_DUPLEX, cv2.FONT_HERSHEY_TRIPLEX, cv2.FONT_HERSHEY_COMPLEX)[index % 3]
        cell.text(name, middle, 0.46, 0.46, ink, weight=0.13, font=font)
        _emblem(cell, 0.08 if index % 3 else 0.16, 0.47, 0.32, index, ink)
        if index % 2:
            _emblem(cell, 0.92, 0.47, 0.32, index + 3, ink)
        fascias.append(cell.image())
    posters = [_poster(index, rng=rng) for index in range(4)]
    blades = []
    for index in range(8):
        ground, ink = SIGN_COLOURS[(index * 3 + 1) % len(SIGN_COLOURS)]
        cell = Canvas(128, 128)
        cell.fill(ink)
        cell.rect(0.05, 0.05, 0.95, 0.95, ground)
        _emblem(cell, 0.5, 0.5, 0.3, index, ink)
        blades.append(cell.image())
    return {"signs": np.concatenate([tiled(fascias, 2), np.concatenate(posters, axis=1), tiled(blades, 8)], axis=0)}


def awnings(*, rng: np.random.Generator) -> Textures:
    """Eight canvases, striped or plain, whose stripes continue at the edge."""
    pairs: list[tuple[Colour, Colour]] = [
        ((0.60, 0.58, 0.53), (0.36, 0.03, 0.03)),
        ((0.60, 0.58, 0.53), (0.03, 0.13, 0.07)),
        ((0.60, 0.58, 0.53), (0.03, 0.06, 0.20)),
        ((0.58, 0.50, 0.36), (0.45, 0.18, 0.03)),
        ((0.30, 0.03, 0.04), (0.30, 0.03, 0.04)),
        ((0.03, 0.09, 0.06), (0.03, 0.09, 0.06)),
        ((0.52, 0.44, 0.30), (0.52, 0.44, 0.30)),
        ((0.05, 0.055, 0.065), (0.05, 0.055, 0.065)),
    ]
    size = 512
    strip = size // AWNING_COUNT
    weave = tileable_noise(size, period=64, octaves=3, rng=rng)
    stripe = (np.arange(size) // (size // 16)) % 2
    rows = [np.where(stripe[:, None] == 0, np.asarray(a), np.asarray(b)) for a, b in pairs]
    albedo = np.concatenate([np.broadcast_to(row, (strip, size, 3)) for row in rows])
    return {"awnings": linear_to_srgb(albedo * (1 + 0.10 * weave)[..., None])}


def lenses(*, rng: np.random.Generator) -> Textures:
    """Lit red, amber and green lenses of LED dots, and a dark one."""
    lit = {
        "red": (0.85, 0.03, 0.012),
        "amber": (0.9, 0.36, 0.01),
        "green": (0.02, 0.72, 0.34),
        "dark": (0.016, 0.016, 0.017),
    }
    cells = []
    for name in LENSES:
        cell = Canvas(128, 128, oversample=4)
        colour = np.asarray(lit[name])
        cell.fill(colour * (0.55 if name != "dark" else 1.0), roughness=0.3)
        if name != "dark":
            for row in range(13):
                for column in range(13):
                    x, y = (column + 0.5 + 0.5 * (row % 2)) / 13, (row + 0.5) / 13
                    cell.ellipse(x, y, 0.032, 0.032, np.clip(colour * 1.15 + float(rng.uniform(0.0, 0.02)), 0, 1))
        cells.append(cell.image())
    return {"lenses": tiled(cells, len(LENSES))}


def ironwork(*, rng: np.random.Generator) -> Textures:
    """Covers of cast iron: their pattern is a height map, from which colour and normals follow."""
    size = 256
    axis = (np.arange(size) + 0.5) / size * 2 - 1
    x, y = np.meshgrid(axis, axis)
    radius = np.hypot(x, y)
    blocks = ((np.mod(x * 9, 1) < 0.62) & (np.mod(y * 9, 1) < 0.62)).astype(float)
    heights = {
        "manhole": np.where(radius > 0.88, 1.0, np.where(radius > 0.82, 0.0, np.where(radius < 0.2, 0.9, blocks))),
        "manhole_square": np.where(
            np.maximum(abs(x), abs(y)) > 0.9,
            1.0,
            np.where(np.maximum(abs(x), abs(y)) > 0.85, 0.0, (np.mod((x + y) * 7, 1) < 0.4).astype(float)),
        ),
        "drain": np.where(
            np.maximum(abs(x), abs(y)) > 0.86, 1.0, np.where((np.mod(x * 5, 1) < 0.45) | (abs(y) < 0.06), 1.0, -3.0)
        ),
        "tree_grate": np.where(
            radius < 0.42,
            -3.0,
            np.where((np.mod(radius * 9, 1) < 0.55) | (np.mod(np.arctan2(y, x) * 8 / np.pi, 1) < 0.16), 1.0, -3.0),
        ),
    }
    noise = tileable_noise(2 * size, period=32, octaves=4, rng=rng)
    ordered = [heights[name] for name in IRONWORK]
    height = np.concatenate([np.concatenate(ordered[:2], 1), np.concatenate(ordered[2:], 1)])
    shade = np.where(height < -1, 0.012, 0.075 + 0.05 * np.clip(height, 0, 1))
    rust = np.clip(noise, 0, 1)[..., None] * np.array([0.05, 0.018, 0.004])
    albedo = (
        shade[..., None] * (1 + 0.25 * noise[..., None]) * np.array([1.0, 0.97, 0.93]) + rust * (height > -1)[..., None]
    )
    relief = 0.004 * np.clip(height, -1, 1)
    return {"ironwork": linear_to_srgb(albedo), "ironwork_n": normal_from_height(relief, (1.4, 1.4))}


def _emblem(cell: Canvas, x: float, y: float, size: float, index: int, ink: Colour) -> None:
    """A made-up mark: discs, petals, bars, a wave."""
    ratio = cell.size[1] / cell.size[0]
    angle = np.arange(24) * 2 * np.pi / 24
    if index % 4 == 0:
        for turn in range(5):
            a = turn * 2 * np.pi / 5 - np.pi / 2
            cell.ellipse(
                x + 0.62 * size * ratio * np.cos(a), y + 0.62 * size * np.sin(a), 0.3 * size * ratio, 0.3 * size, ink
            )
    elif index % 4 == 1:
        for k in range(3):
            cell.rect(
                x + (k - 1.2) * 0.6 * size * ratio,
                y + size * (0.6 - 0.5 * k),
                x + (k - 0.7) * 0.6 * size * ratio,
                y + size,
                ink,
            )
    elif index % 4 == 2:
        ring = np.stack([x + size * ratio * np.cos(angle), y + size * np.sin(angle)], 1)
        cell.line(ring, 0.09 * size / 0.3, ink, closed=True)
        cell.ellipse(x, y, 0.4 * size * ratio, 0.4 * size, ink)
    else:
        t = np.linspace(-1, 1, 24)
        for shift in (-0.5, 0.0, 0.5):
            cell.line(
                np.stack([x + t * size * ratio, y + size * (shift + 0.25 * np.sin(t * 5))], 1), 0.06 * size / 0.3, ink
            )


def _poster(index: int, *, rng: np.random.Generator) -> Image:
    cell = Canvas(256, 384)
    ground = np.array([(0.05, 0.20, 0.32), (0.55, 0.40, 0.10), (0.50, 0.47, 0.42), (0.22, 0.06, 0.10)][index])
    ink = np.array([(0.68, 0.66, 0.6), (0.06, 0.03, 0.03), (0.05, 0.10, 0.10), (0.66, 0.50, 0.22)][index])
    cell.fill((0.6, 0.59, 0.56))
    cell.rect(0.03, 0.02, 0.97, 0.98, ground)
    cell.gradient(0.03, 0.02, 0.97, 0.7, ground * 1.25, ground * 0.8)
    for _ in range(7):
        x, y, r = rng.uniform(0.15, 0.85), rng.uniform(0.15, 0.6), rng.uniform(0.05, 0.2)
        tone = np.clip(ground * rng.uniform(0.4, 1.8) + rng.uniform(0, 0.12, 3), 0, 0.7)
        cell.ellipse(x, y, r, r * 2 / 3, tone)
    cell.text(("SONARA", "festa 12", "Museo Lin", "NOTTE")[index], 0.5, 0.77, 0.06, ink, weight=0.14)
    for row in range(3):
        cell.rect(0.2, 0.85 + row * 0.03, 0.8 - 0.12 * row, 0.862 + row * 0.03, ink)
    return cell.image()
