"""Surfaces without blocks: asphalt, concrete, plaster, paint, grass, soil, metal sheet, boards, bark, foliage."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from authoring.materials.image import Image, linear_to_srgb, normal_from_height, open_sky, orm, rough
from authoring.materials.noise import tileable_noise, worley, wrapped_blur

Array = npt.NDArray[np.float64]
Textures = dict[str, Image]
# Linear albedo of a road some years old, and its tint.
ASPHALT, ASPHALT_TINT = 0.112, np.array([1.0, 0.985, 0.955])


def asphalt(*, rng: np.random.Generator) -> Textures:
    """A sound road and a worn one with cracks, sealed cracks and a patch; they share the ORM map."""
    size, tile_m = 1024, 6.0
    stones = tileable_noise(size, period=256, octaves=3, rng=rng, gain=0.9)
    broad = tileable_noise(size, period=3, octaves=5, rng=rng, gain=0.6)
    speck = _specks(size, rng=rng)
    grey = _aggregate(stones, broad, speck)
    height = 0.0016 * stones + 0.0022 * speck
    textures: Textures = {
        "asphalt": linear_to_srgb(grey[..., None] * ASPHALT_TINT),
        "asphalt_n": normal_from_height(height, (tile_m, tile_m)),
        "asphalt_orm": orm(1.0, np.clip(0.86 + 0.05 * broad + 0.03 * stones, 0, 1), 0.0),
    }
    crack = _cracks(size, paths=9, rng=rng)
    sealed = _cracks(size, paths=4, rng=rng, width_px=9)
    patch = _patch(size, rng=rng)
    rim = np.abs(patch - wrapped_blur(patch, 2.0)) * 2
    worn = grey * 1.1 * (1 + 0.14 * tileable_noise(size, period=6, octaves=4, rng=rng))
    worn = worn * (1 - patch) + patch * 0.060 * (1 + 0.12 * stones)
    worn = worn * (1 - 0.45 * rim.clip(0, 1)) * (1 - 0.72 * crack) * (1 - sealed) + sealed * 0.030 * (1 + 0.1 * stones)
    worn_height = height * (1 - 0.6 * sealed) - 0.006 * crack + 0.003 * sealed + 0.003 * patch
    textures["asphalt_worn"] = linear_to_srgb(worn[..., None] * ASPHALT_TINT)
    textures["asphalt_worn_n"] = normal_from_height(worn_height, (tile_m, tile_m))
    return textures


def asphalt_lanes(*, rng: np.random.Generator) -> Textures:
    """A driven lane, u across it with its middle at 0.5: tracks that tyres polish, a line of oil between them.

    Its margins are those of `asphalt`. In the end piece all that fades away from v = 0 to v = 1.
    """
    size, tile_m, track_m = 1024, 6.0, 0.78
    across_m = ((np.arange(size) + 0.5) / size - 0.5)[None, :] * tile_m
    textures: Textures = {}
    for stem, share in (("asphalt_lane", np.ones(size)), ("asphalt_lane_end", (np.arange(size) + 0.5) / size)):
        stones = tileable_noise(size, period=256, octaves=3, rng=rng, gain=0.9)
        broad = tileable_noise(size, period=3, octaves=5, rng=rng, gain=0.6)
        drops = tileable_noise(size, period=12, octaves=4, rng=rng)
        oil = np.exp(-((across_m / 0.36) ** 2)) * (0.24 + 0.10 * drops + 0.05 * broad)
        tracks = np.exp(-(((np.abs(across_m) - track_m) / 0.30) ** 2)) * (0.13 + 0.04 * broad)
        wear = 1 + share[:, None] * (tracks - oil)
        grey = _aggregate(stones, broad, _specks(size, rng=rng)) * wear
        textures[stem] = linear_to_srgb(grey[..., None] * ASPHALT_TINT)
    return textures


def concrete(*, rng: np.random.Generator) -> Textures:
    """Cast concrete: boards' and panel joints, tie holes, stains; the kerb shares its normal and ORM maps."""
    size, tile_m = 1024, 4.0
    fine = tileable_noise(size, period=256, octaves=2, rng=rng)
    broad = tileable_noise(size, period=3, octaves=6, rng=rng)
    streaks = _streaks(size, rng=rng)
    axis = (np.arange(size) + 0.5) / size * tile_m
    x, y = np.meshgrid(axis, axis)
    joint = np.minimum(_to_line(x, 2.0), _to_line(y, 2.0))
    groove = np.clip((0.008 - joint) / 0.004, 0, 1)
    holes = np.clip((0.018 - np.hypot(_to_line(x - 0.5, 1.0), _to_line(y - 0.5, 1.0))) / 0.005, 0, 1)
    pores = np.clip(tileable_noise(size, period=128, octaves=2, rng=rng) - 0.85, 0, 1) * 4
    shade = (
        (1 + 0.13 * broad + 0.04 * fine - 0.10 * streaks) * (1 - 0.45 * groove) * (1 - 0.5 * holes) * (1 - 0.3 * pores)
    )
    albedo = np.array([0.36, 0.35, 0.325]) * shade[..., None]
    height = 0.0005 * fine + 0.0006 * broad - 0.006 * groove - 0.012 * holes - 0.002 * pores
    kerb_size = 512
    kerb_fine = tileable_noise(kerb_size, period=128, octaves=3, rng=rng, gain=0.8)
    kerb_axis = (np.arange(kerb_size) + 0.5) / kerb_size * 2.0
    kerb_joint = np.clip((0.006 - _to_line(kerb_axis, 1.0)) / 0.004, 0, 1)[None, :]
    dirt = tileable_noise(kerb_size, period=4, octaves=4, rng=rng)
    kerb = np.array([0.34, 0.335, 0.32]) * ((1 + 0.14 * kerb_fine + 0.12 * dirt) * (1 - 0.6 * kerb_joint))[..., None]
    # Where rain runs the skin of cement is washed off; what the forms' joints left is rougher, too.
    roughness = rough(0.85, 0.08 * broad + 0.06 * streaks + 0.08 * groove + 0.05 * holes)
    return {
        "concrete": linear_to_srgb(albedo),
        "concrete_n": normal_from_height(height, (tile_m, tile_m)),
        "concrete_orm": orm(open_sky(height, tile_m), roughness, 0.0),
        "kerb": linear_to_srgb(kerb),
    }


def plaster(*, rng: np.random.Generator) -> Textures:
    """Rendered wall, nearly white: its colour comes from the material's tint."""
    size, tile_m = 512, 4.0
    fine = tileable_noise(size, period=128, octaves=3, rng=rng, gain=0.8)
    broad = tileable_noise(size, period=2, octaves=6, rng=rng, gain=0.55)
    streaks = _streaks(size, rng=rng)
    shade = 0.80 * (1 + 0.05 * fine + 0.085 * broad - 0.06 * streaks)
    tone = np.stack([np.ones_like(shade), 1 + 0.012 * broad, 1 + 0.03 * broad], -1)
    height = 0.0016 * fine + 0.003 * broad
    return {
        "plaster": linear_to_srgb(shade[..., None] * tone),
        "plaster_n": normal_from_height(height, (tile_m, tile_m)),
        # The trowel left smoother patches; dirt in the streaks is dull.
        "plaster_orm": orm(open_sky(height, tile_m), rough(0.85, 0.09 * broad + 0.06 * streaks), 0.0),
    }


def metal_panel(*, rng: np.random.Generator) -> Textures:
    """Standing-seam cladding in grey, 0.5 m panels with a shadow gap."""
    size, tile_m = 512, 2.0
    broad = tileable_noise(size, period=4, octaves=5, rng=rng)
    axis = (np.arange(size) + 0.5) / size * tile_m
    x, y = np.meshgrid(axis, axis)
    seam = np.clip((0.012 - _to_line(x, 0.5)) / 0.006, 0, 1)
    lap = np.clip((0.007 - _to_line(y, 1.0)) / 0.004, 0, 1)
    panel = rng.uniform(0.93, 1.07, (2, 4))[np.floor(y).astype(int) % 2, np.floor(x / 0.5).astype(int) % 4]
    gap = np.maximum(seam, lap)
    shade = panel * (1 + 0.05 * broad) * (1 - 0.65 * gap)
    albedo = np.array([0.24, 0.255, 0.27]) * shade[..., None]
    height = -0.010 * gap + 0.0004 * broad
    return {
        "metal_panel": linear_to_srgb(albedo),
        "metal_panel_n": normal_from_height(height, (tile_m, tile_m)),
        "metal_panel_orm": orm(1 - 0.5 * gap, np.clip(0.46 + 0.08 * broad + 0.3 * gap, 0, 1), 0.55 * (1 - gap)),
    }


def boards(*, rng: np.random.Generator) -> Textures:
    """Upright timber boards of 0.125 m."""
    size, tile_m, count = 512, 2.0, 16
    axis = (np.arange(size) + 0.5) / size * tile_m
    x, _ = np.meshgrid(axis, axis)
    board = np.floor(x / tile_m * count).astype(int) % count
    grain = _grain(size, rng=rng)
    gap = np.clip((0.005 - _to_line(x, tile_m / count)) / 0.003, 0, 1)
    shade = rng.uniform(0.78, 1.18, count)[board] * (1 + 0.22 * grain) * (1 - 0.75 * gap)
    albedo = np.array([0.25, 0.145, 0.075]) * shade[..., None]
    height = 0.0008 * grain - 0.006 * gap
    # Each board has kept as much of its varnish as it has.
    varnish = rng.uniform(-0.09, 0.09, count)[board]
    return {
        "wood": linear_to_srgb(albedo),
        "wood_n": normal_from_height(height, (tile_m, tile_m)),
        "wood_orm": orm(1 - 0.5 * gap, rough(0.75, varnish + 0.06 * grain + 0.1 * gap), 0.0),
    }


def road_paint(*, rng: np.random.Generator) -> Textures:
    """White marking paint, worn where tyres run; tinted for yellow."""
    size = 512
    fine = tileable_noise(size, period=128, octaves=3, rng=rng, gain=0.8)
    broad = tileable_noise(size, period=4, octaves=5, rng=rng)
    worn = np.clip((fine * 0.9 + broad * 1.1 - 0.62) * 2.2, 0, 0.85)
    paint = 0.66 * (1 + 0.06 * broad + 0.04 * fine)
    albedo = paint * (1 - worn) + 0.11 * worn
    return {"road_paint": linear_to_srgb(albedo[..., None] * np.array([1.0, 0.99, 0.955]))}


def grass(*, rng: np.random.Generator) -> Textures:
    """Mown grass: blades of many greens, some dry, bare spots."""
    size, tile_m = 1024, 4.0
    broad = tileable_noise(size, period=4, octaves=5, rng=rng)
    picture = np.full((size, size, 3), (0.030, 0.042, 0.012))
    depth = np.zeros((size, size))
    greens = np.array([(0.060, 0.088, 0.024), (0.078, 0.108, 0.032), (0.105, 0.125, 0.045), (0.18, 0.155, 0.075)])
    for index in range(15000):
        x, y = rng.uniform(0, size, 2)
        angle, length = rng.uniform(0, np.pi), rng.uniform(10, 26)
        spot = broad[int(y) % size, int(x) % size]
        colour = greens[rng.choice(4, p=[0.34, 0.34, 0.22, 0.10])] * rng.uniform(0.65, 1.25) * (1 + 0.25 * spot)
        end = (x + np.cos(angle) * length, y + np.sin(angle) * length)
        level = index / 15000
        for dx in (0, -size, size) if end[0] > size - 1 or end[0] < 0 or x < 2 else (0,):
            for dy in (0, -size, size) if end[1] > size - 1 or y < 2 else (0,):
                start, stop = (int(x + dx), int(y + dy)), (int(end[0] + dx), int(end[1] + dy))
                cv2.line(picture, start, stop, tuple(map(float, colour)), 2, cv2.LINE_8)
                cv2.line(depth, start, stop, level, 2, cv2.LINE_8)
    return {
        "grass": linear_to_srgb(picture),
        "grass_n": normal_from_height(0.014 * wrapped_blur(depth, 0.7), (tile_m, tile_m)),
    }


def soil(*, rng: np.random.Generator) -> Textures:
    """Earth with clods and chips of bark."""
    size, tile_m, cells = 512, 3.0, 48
    near, second, clod = worley(size, cells=cells, rng=rng)
    broad = tileable_noise(size, period=4, octaves=6, rng=rng)
    tone = rng.uniform(0.6, 1.4, cells * cells)[clod] * (1 + 0.25 * broad)
    gap = np.clip((second - near) / 0.3, 0, 1)
    albedo = np.array([0.085, 0.058, 0.036]) * (tone * (0.5 + 0.5 * gap))[..., None]
    return {"soil": linear_to_srgb(albedo), "soil_n": normal_from_height(0.014 * gap + 0.006 * broad, (tile_m, tile_m))}


def bark(*, rng: np.random.Generator) -> Textures:
    """Furrowed bark: plates longer than wide, from ridges that wander along the trunk."""
    size, tile_m = 512, 1.0
    warp = _grain(size, rng=rng, along_px=40, across_px=9)
    ridges = _grain(size, rng=rng, along_px=30, across_px=4)
    cross = tileable_noise(size, period=16, octaves=3, rng=rng)
    fine = _grain(size, rng=rng)
    plate = np.clip(0.55 + 0.9 * np.abs(ridges) + 0.25 * warp - 0.35 * np.clip(cross, 0, 1), 0, 1)
    albedo = np.array([0.135, 0.108, 0.082]) * ((0.3 + 0.9 * plate) * (1 + 0.2 * fine + 0.15 * warp))[..., None]
    return {
        "bark": linear_to_srgb(albedo),
        "bark_n": normal_from_height(0.012 * plate + 0.002 * fine, (tile_m, tile_m)),
    }


def foliage(*, rng: np.random.Generator) -> Textures:
    """A mass of leaves seen from outside, neutral green: brightest at the top layer; its colour is the tint."""
    size, tile_m = 512, 1.6
    picture = np.full((size, size, 3), (0.008, 0.012, 0.006))
    height = np.zeros((size, size))
    count = 2600
    for index in range(count):
        level = index / count
        x, y = rng.uniform(0, size, 2)
        angle = float(rng.uniform(0, 360))
        length, width = rng.uniform(11, 19), rng.uniform(4.5, 7.5)
        hue = np.array([0.150, 0.205, 0.066]) * rng.uniform(0.7, 1.3) * (0.12 + 0.95 * level**1.3)
        hue = hue * (1 + rng.uniform(-0.12, 0.25) * np.array([1.0, 0.3, 0.0]))
        slope = np.radians(angle)
        for dx in (-size, 0, size):
            for dy in (-size, 0, size):
                centre = (x + dx, y + dy)
                if not (-24 < centre[0] < size + 24 and -24 < centre[1] < size + 24):
                    continue
                at, axes = (round(centre[0]), round(centre[1])), (round(length), round(width))
                cv2.ellipse(picture, at, axes, angle, 0, 360, tuple(map(float, hue)), -1, cv2.LINE_8)
                cv2.ellipse(picture, at, axes, angle, 0, 180, tuple(map(float, hue * 0.8)), -1, cv2.LINE_8)
                rib = (round(np.cos(slope) * length), round(np.sin(slope) * length))
                cv2.line(
                    picture,
                    (at[0] - rib[0], at[1] - rib[1]),
                    (at[0] + rib[0], at[1] + rib[1]),
                    tuple(map(float, hue * 1.3)),
                    1,
                )
                cv2.ellipse(height, at, axes, angle, 0, 360, level, -1, cv2.LINE_8)
    relief = wrapped_blur(height, 1.0)
    return {"foliage": linear_to_srgb(picture), "foliage_n": normal_from_height(0.022 * relief, (tile_m, tile_m))}


def _to_line(position: Array, pitch: float) -> Array:
    """Distance to the nearest multiple of `pitch`."""
    return np.abs(np.mod(position + pitch / 2, pitch) - pitch / 2)


def _grain(size_px: int, *, rng: np.random.Generator, along_px: float = 22, across_px: float = 1.2) -> Array:
    """Upright grain of some length and width, about -1..1."""
    noise = rng.normal(size=(size_px, size_px))
    rows, columns = (np.fft.fftfreq(n) for n in (size_px, size_px))
    kernel = np.exp(-2 * np.pi**2 * ((along_px * rows[:, None]) ** 2 + (across_px * columns[None]) ** 2))
    grain = np.fft.ifft2(np.fft.fft2(noise) * kernel).real
    return np.asarray(np.clip(grain / (2 * grain.std()), -1.5, 1.5))


def _streaks(size_px: int, *, rng: np.random.Generator) -> Array:
    """Rain streaks that run down a wall, 0..1."""
    return np.clip(_grain(size_px, rng=rng, along_px=60, across_px=3), 0, 1)


def _specks(size_px: int, *, rng: np.random.Generator) -> Array:
    """Single light stones of asphalt, 0 elsewhere."""
    return np.clip(tileable_noise(size_px, period=512, octaves=1, rng=rng) - 0.75, 0, 1) * 2.5


def _aggregate(stones: Array, broad: Array, speck: Array) -> Array:
    """The linear albedo of asphalt from its stones, its blotches and its specks."""
    return ASPHALT * (1 + 0.14 * stones + 0.06 * broad + 0.28 * speck)


def _cracks(size_px: int, *, paths: int, rng: np.random.Generator, width_px: int = 2) -> Array:
    """Wandering lines that wrap, 0..1."""
    canvas = np.zeros((size_px, size_px))
    for _ in range(paths):
        x, y = rng.uniform(0, size_px, 2)
        heading = rng.uniform(0, 2 * np.pi)
        for _ in range(int(rng.integers(25, 70))):
            heading += rng.normal(0, 0.35)
            end = (x + np.cos(heading) * 11, y + np.sin(heading) * 11)
            for dx in (-size_px, 0, size_px):
                for dy in (-size_px, 0, size_px):
                    start, stop = (round(x + dx), round(y + dy)), (round(end[0] + dx), round(end[1] + dy))
                    cv2.line(canvas, start, stop, 1.0, width_px)
            x, y = end[0] % size_px, end[1] % size_px
    return wrapped_blur(canvas, 0.6).clip(0, 1)


def _patch(size_px: int, *, rng: np.random.Generator) -> Array:
    """One repaired rectangle with an uneven edge, 0..1."""
    ragged = 6 * tileable_noise(size_px, period=32, octaves=2, rng=rng)
    rows, columns = np.indices((size_px, size_px))
    inside = np.minimum(
        np.minimum(columns - 0.18 * size_px, 0.46 * size_px - columns),
        np.minimum(rows - 0.55 * size_px, 0.80 * size_px - rows),
    )
    patch: Array = np.clip((inside + ragged) / 2, 0, 1)
    return patch
