"""A sheet of thumbnails: one rendered sample of every scene of a town, from the camera of the ego car."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass

import numpy as np

from gear.config.collection import SplitConfig
from gear.contracts.rendering import Quality
from gear.render.registry import open_renderer
from gear.values.errors import GearError, PlacementError, TownError
from gear.values.frames import UInt8Image
from gear.values.progress import Progress
from gear.values.rig import CameraMount, Rig
from gear.values.scene import Weather
from gear.verbs.towns.canvas import Canvas
from gear.verbs.towns.facts import Town
from gear.world.planner import ScenePlanner
from gear.world.scene_spec import SceneSpec
from gear.world.weather.air import camera_pipeline
from gear.world.weather.mirror_view import render_mirror_view
from gear.world.weather.night import night_of
from gear.world.world import World

COLUMNS = 3
CAPTION_PX, GAP_PX = 44, 12
PAPER, INK, MUTED = (255, 255, 255), (30, 30, 36), (110, 110, 118)


@dataclass(frozen=True, slots=True, kw_only=True)
class SheetOptions:
    """Settings of the thumbnails.

    Attributes:
        renderer, quality: name of the renderer, and its quality (`film` or `fast`).
        weather: weather of the rendered scenes.
        seed: seed of the sampled viewpoints.
        width_px, height_px: size of one thumbnail.
    """

    renderer: str
    quality: Quality
    weather: Weather
    seed: int
    width_px: int = 640
    height_px: int = 320


def draw_sheet(
    town: Town, options: SheetOptions, on_progress: Progress | None = None
) -> tuple[UInt8Image, list[GearError]]:
    """Renders one sample of every scene of a town and arranges the pictures in a grid.

    Args:
        town: a town with scenes.
        options: settings of the thumbnails.
        on_progress: called with the numbers of finished and of all scenes.

    Returns:
        The sheet, (H, W, 3) uint8 RGB, and the errors of scenes that cannot be composed or planned; their cells show
        the error.

    Raises:
        BackendError: the renderer cannot start.
    """
    assert town.scenes is not None  # checked by the caller
    cells: list[UInt8Image] = []
    problems: list[GearError] = []
    for number, (name, scene) in enumerate(town.scenes.scenes.items()):
        if on_progress is not None:
            on_progress(number, len(town.scenes.scenes))
        try:
            cells.append(_cell(*thumbnail(town, name, scene, options), name))
        except (PlacementError, TownError) as error:
            problems.append(error)
            note = "cannot be planned" if isinstance(error, PlacementError) else "cannot be composed"
            cells.append(_cell(_complaint(error.problem, options), note, name))
    if on_progress is not None:
        on_progress(len(cells), len(cells))
    return _grid(cells), problems


def thumbnail(town: Town, name: str, scene: SceneSpec, options: SheetOptions) -> tuple[UInt8Image, str]:
    """Renders one sample of a scene; returns (H, W, 3) uint8 RGB and a line about its patch surfaces and road users.

    Args:
        town: the town.
        name: name of the scene.
        scene: the scene.
        options: renderer, quality, weather, seed and size of the picture.
    """
    world = World.build(town=town.library.town, scene_name=name, scene=scene, weather=options.weather)
    rig = Rig(cameras=(CameraMount(name="rgb", width_px=options.width_px, height_px=options.height_px),))
    record = ScenePlanner(world, rig, SplitConfig(seed=options.seed, samples=1), split_name="debug").plan(0)
    placed = world.place(record)
    night = night_of(world, options.weather, options.renderer)
    pipeline = camera_pipeline(options.weather, options.renderer, world.town_name, night=night, shapes=world.shapes)
    renderer = open_renderer(options.renderer, world.model, quality=options.quality)
    try:
        (view,) = renderer.render(placed.stage, record.cameras)
        (below,) = render_mirror_view(world, renderer, placed, record, pipeline)
    finally:
        renderer.close()
    seen = []
    for face in world.faces:
        pixels = view.geom_id == face.geom_id
        where = f"{np.nanmean(view.depth_m[pixels]):.0f} m ahead, " if pixels.any() else ""
        seen.append(f"{face.asset} {where}{pixels.mean():.1%} of the picture")
    others = len(record.actors) - 1
    shown = pipeline.view(view, record.cameras[0], record, placed.geoms, reflection=pipeline.reflection(below, record))
    return shown.rgb, "; ".join([*seen, f"{others} other road users"])


def _complaint(problem: str, options: SheetOptions) -> UInt8Image:
    canvas = Canvas((options.width_px, options.height_px), (244, 240, 238))
    for number, line in enumerate(textwrap.wrap(problem, options.width_px // 9)):
        canvas.text((24, 48 + 24 * number), line, 11, (170, 40, 40))
    return canvas.picture()


def _cell(picture: UInt8Image, note: str, name: str) -> UInt8Image:
    canvas = Canvas((picture.shape[1], CAPTION_PX), PAPER)
    canvas.text((1, 16), name, 11, INK, bold=True)
    canvas.text((1, 35), note, 9, MUTED)
    return np.concatenate([picture, canvas.picture()])


def _grid(cells: list[UInt8Image]) -> UInt8Image:
    height, width = cells[0].shape[:2]
    columns = min(COLUMNS, len(cells))
    rows = -(-len(cells) // columns)
    sheet = np.full((rows * height + 2 * GAP_PX, columns * (width + GAP_PX) + GAP_PX, 3), PAPER, np.uint8)
    for number, cell in enumerate(cells):
        y, x = GAP_PX + number // columns * height, GAP_PX + number % columns * (width + GAP_PX)
        sheet[y : y + height, x : x + width] = cell
    return sheet
