"""`gear.write_town`: writes the map and the thumbnails of a town."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import cv2

from gear.contracts.rendering import Quality
from gear.dataset.files import explained, write_alone
from gear.render.registry import describe
from gear.reporting.display import displayed
from gear.values.errors import GearError, TownError, UnknownNameError
from gear.values.frames import UInt8Image
from gear.values.progress import Callbacks, Progress
from gear.verbs.towns.facts import Town, read_town
from gear.verbs.towns.ground_layer import TownGeometry
from gear.verbs.towns.sheet import SheetOptions, draw_sheet
from gear.verbs.towns.town_map import draw_map
from gear.world.surfaces.face_size import asset_face_size_m
from gear.world.weather.presets import PRESETS

QUALITIES: tuple[Quality, ...] = ("film", "fast")


@dataclass(frozen=True, slots=True, kw_only=True)
class TownReport:
    """The result of `gear.write_town`.

    Attributes:
        town: the town.
        map: path of the map.
        sheet: path of the sheet of thumbnails; None if the town has no scenes.
        problems: errors of the scenes that cannot be read, composed or planned.
    """

    town: Town
    map: Path
    sheet: Path | None
    problems: tuple[GearError, ...] = ()

    def summary(self) -> str:
        """Returns one line with the paths and the number of scenes."""
        files = [str(path) for path in (self.map, self.sheet) if path is not None]
        count = 0 if self.town.scenes is None else len(self.town.scenes.scenes)
        return f"{' and '.join(files)}: {self.town.name} with {count} scene{'' if count == 1 else 's'}"


def write_town(
    town: str | Path,
    out: str | Path,
    *,
    scenes: str | Path | None = None,
    renderer: str = "raster",
    quality: str = "fast",
    weather: str = "ClearNoon",
    seed: int = 0,
    progress: bool = False,
    on_progress: Progress | None = None,
) -> TownReport:
    """Writes two pictures of a town: `<town>_map.png`, a map, and `<town>_scenes.png`, a thumbnail of every scene.

    Args:
        town: name of a town, or path of its MJCF file.
        out: folder of the files; it is created if it does not exist.
        scenes: path of a scene library; None takes the library that is part of gear.
        renderer, quality: renderer of the thumbnails, and its quality.
        weather: name of a weather preset.
        seed: seed of the viewpoints of the thumbnails.
        progress: shows a progress bar.
        on_progress: called after every thumbnail with the numbers of finished and of all thumbnails.

    Raises:
        UnknownNameError: there is no such town, file, renderer, quality or weather.
        BackendError: the renderer does not start on this machine; the message says what to install.
        TownError: the MJCF file breaks gear's conventions for towns.
        ConfigError: no scene of the library is usable, or the library is for another town.
        DatasetError: `out` cannot be written.
        GearError: the seed is negative.
    """
    check_pictures(renderer=renderer, quality=quality, weather=weather, seed=seed)
    found = _drawable(read_town(town, scenes))
    folder = Path(out)
    with explained(folder):  # fails before minutes are spent on drawing
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    map_path = _write(folder / f"{found.name}_map.png", draw_map(found, TownGeometry.of(found.library.town)))
    sheet_path: Path | None = None
    problems: list[GearError] = []
    if found.scenes is not None:
        options = SheetOptions(
            renderer=renderer, quality="film" if quality == "film" else "fast", weather=PRESETS[weather], seed=seed
        )
        with displayed(Callbacks.of(on_progress=on_progress), "towns", progress=progress, unit="scene") as shown:
            shown.on_progress(0, len(found.scenes.scenes))
            picture, problems = draw_sheet(found, options, shown.on_progress)
        sheet_path = _write(folder / f"{found.name}_scenes.png", picture)
    problems = [*found.faulty.values(), *problems]
    return TownReport(town=found, map=map_path, sheet=sheet_path, problems=tuple(problems))


def _drawable(town: Town) -> Town:
    """Returns the town without the scenes whose boards cannot be compiled; these are moved to its faulty scenes."""
    if town.scenes is None:
        return town
    faulty: dict[str, GearError] = {}
    for name, scene in town.scenes.scenes.items():
        try:
            for board in scene.boards:
                asset_face_size_m(town.library.path("surface", board.asset))
        except TownError as error:
            faulty[name] = error
    if not faulty:
        return town
    if len(faulty) == len(town.scenes.scenes):
        raise next(iter(faulty.values()))
    usable = {name: scene for name, scene in town.scenes.scenes.items() if name not in faulty}
    return replace(town, scenes=replace(town.scenes, scenes=usable), faulty={**town.faulty, **faulty})


def check_pictures(*, renderer: str, quality: str, weather: str, seed: int) -> None:
    """Checks the settings of the thumbnails that `gear.write_town` renders.

    Raises:
        UnknownNameError: there is no such renderer, quality or weather.
        GearError: the seed is negative.
    """
    describe(renderer)
    if weather not in PRESETS:
        raise UnknownNameError("weather", weather, PRESETS)
    if quality not in QUALITIES:
        raise UnknownNameError("quality", quality, QUALITIES)
    if seed < 0:
        raise GearError(f"--seed must not be negative, got {seed}")


def _write(target: Path, picture: UInt8Image) -> Path:
    data = cv2.imencode(".png", picture[..., ::-1])[1].tobytes()
    write_alone(target, data)
    return target
