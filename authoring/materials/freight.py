"""Pictures of the freight trade: container sides and doors, and the large signs over motorways."""

from __future__ import annotations

import numpy as np

from authoring.materials.canvas import Canvas, Colour, tiled
from authoring.materials.image import Image
from authoring.materials.noise import tileable_noise

Textures = dict[str, Image]
Rect = tuple[float, float, float, float]
WHITE, BLUE = (0.70, 0.70, 0.68), (0.012, 0.075, 0.34)
GREY = (0.30, 0.30, 0.29)
# colour, and what is written on the side
LINERS: tuple[tuple[Colour, str], ...] = (
    ((0.23, 0.045, 0.03), "NORDIK"),
    ((0.025, 0.075, 0.19), "VELAMAR"),
    ((0.03, 0.13, 0.085), "GRUNSEE"),
    ((0.46, 0.16, 0.03), "ORANTO"),
    ((0.36, 0.36, 0.34), "POLARIA"),
    ((0.16, 0.075, 0.045), "TRANSOLA"),
    ((0.05, 0.20, 0.27), "MERIDA"),
    ((0.52, 0.46, 0.36), "KESTREL"),
)
DOOR_U = 0.82
RIBS = 40
# How deep the corrugation is, and what a row of the atlas shows: a long side with the doors beside it.
RIB_M = 0.036
SIDE_M = (14.6, 2.6)
# lines of text, and the arrow beside them: 0 up, 1 half right, 2 none
PANELS: tuple[tuple[tuple[str, ...], int], ...] = (
    (("Harbour", "Docks 1-4"), 1),
    (("City centre", "Airport"), 0),
    (("Exit 7", "Estate East"), 1),
    (("Ferry port", "Lorries"), 2),
)


def container_rect(liner: int, *, door: bool) -> Rect:
    """The UV rectangle of a container's long side, or of its doors."""
    rows = len(LINERS)
    v0 = 1 - (liner % rows + 1) / rows
    return (DOOR_U + 0.004 if door else 0.002), v0 + 0.004, (0.998 if door else DOOR_U - 0.004), v0 + 1 / rows - 0.004


def panel_rect(panel: int) -> Rect:
    """The UV rectangle of a large direction sign, three wide to two high."""
    row, column = divmod(panel % len(PANELS), 2)
    return column / 2 + 0.002, 0.5 - row / 2 + 0.002, column / 2 + 0.498, 1 - row / 2 - 0.002


def containers(*, rng: np.random.Generator) -> Textures:
    """Eight liveries: a corrugated side, and doors with their locking bars."""
    rows = [_livery(colour, name, rng=rng) for colour, name in LINERS]
    return {
        "containers": np.concatenate([row.image() for row in rows]),
        # Between its ribs a side sees less of the sky.
        "containers_orm": np.concatenate([row.orm(0.8 + 0.2 * row.finished_relief_m() / RIB_M) for row in rows]),
        "containers_n": np.concatenate([row.normal(SIDE_M) for row in rows]),
    }


def direction_signs(*, rng: np.random.Generator) -> Textures:
    """Four blue panels with a white rim."""
    cells = []
    for lines, arrow in PANELS:
        cell = Canvas(512, 256, oversample=2)
        cell.fill(WHITE)
        cell.rect(0.012, 0.024, 0.988, 0.976, BLUE)
        for index, words in enumerate(lines):
            cell.text(words, 0.42 if arrow != 2 else 0.5, 0.3 + 0.38 * index, 0.165, WHITE, weight=0.12)
        if arrow == 0:
            cell.line([(0.88, 0.85), (0.88, 0.25)], 0.07, WHITE)
            cell.polygon([(0.88, 0.12), (0.94, 0.36), (0.82, 0.36)], WHITE)
        elif arrow == 1:
            cell.line([(0.82, 0.82), (0.92, 0.34)], 0.07, WHITE)
            cell.polygon([(0.955, 0.17), (0.965, 0.45), (0.865, 0.36)], WHITE)
        dust = tileable_noise(cell.size[0], period=4, octaves=5, rng=rng)[: cell.size[1]]
        cell.albedo *= (1 + 0.05 * dust)[..., None]
        cells.append(cell.image())
    return {"direction_signs": tiled(cells, 2)}


def _livery(colour: Colour, name: str, *, rng: np.random.Generator) -> Canvas:
    cell = Canvas(1024, 128, oversample=2)
    base = np.asarray(colour)
    cell.fill(base, roughness=0.58)
    cell.relief_m[:] = RIB_M
    side, web = round(DOOR_U * cell.size[0]), slice(round(0.05 * cell.size[1]), round(0.95 * cell.size[1]))
    # Flanks fall from crests to troughs, all of them about a quarter of the pitch wide.
    across = np.abs((np.arange(side) + 0.5) / side * RIBS % 1 - 0.51)
    cell.relief_m[web, :side] *= np.clip(1 - (across - 0.11) / 0.26, 0, 1)
    for rib in range(RIBS):
        x = DOOR_U * (rib + 0.5) / RIBS
        step = DOOR_U / RIBS
        cell.rect(x - 0.10 * step, 0.05, x + 0.12 * step, 0.95, base * 1.22, roughness=0.58)
        cell.rect(x + 0.12 * step, 0.05, x + 0.38 * step, 0.95, base * 0.62, roughness=0.58)
    cell.text(name, DOOR_U * 0.42, 0.46, 0.36, WHITE if base.mean() < 0.3 else (0.03, 0.05, 0.12), weight=0.15)
    for y in (0.0, 0.945):
        cell.rect(0, y, 1, y + 0.055, base * 0.75, roughness=0.6)
    for x in (0.0, DOOR_U - 0.012, DOOR_U, 0.989):
        cell.rect(x, 0, x + 0.012, 1, base * 0.8, roughness=0.6, height_m=RIB_M)
    for part in (0.25, 0.42, 0.58, 0.75):
        x = DOOR_U + (1 - DOOR_U) * part
        cell.rect(x - 0.002, 0.08, x + 0.002, 0.93, GREY, roughness=0.5, height_m=RIB_M + 0.03)
        cell.rect(x - 0.001, 0.55, x + 0.013, 0.585, GREY)
    cell.rect(DOOR_U + (1 - DOOR_U) * 0.5 - 0.001, 0.06, DOOR_U + (1 - DOOR_U) * 0.5 + 0.001, 0.94, base * 0.3)
    cell.rect(DOOR_U + 0.1, 0.16, DOOR_U + 0.155, 0.32, np.asarray(WHITE) * 0.8)
    noise = tileable_noise(2048, period=16, octaves=6, rng=rng)[:256]
    cell.albedo *= (1 + 0.10 * noise)[..., None]
    rust = np.clip((noise - 0.66) * 5, 0, 1)[..., None] * 0.8
    cell.albedo = cell.albedo * (1 - rust) + np.array([0.11, 0.05, 0.028]) * rust
    cell.surface[..., 0] += (0.92 - cell.surface[..., 0]) * rust[..., 0]
    return cell
