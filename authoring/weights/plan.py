"""The data of the reference weights: which scenes, weathers, patches and seeds, and which are never trained on.

Two scenes (town10's billboard07, suburb's billboard05) and one weather (CloudyNoon) are held out: nothing is trained
on them, and no checkpoint is chosen by them. Training seeds are 20000 to 20999, those of the held-out collections 30000
to 30999; the seeds of the paper's splits (123, 131, 363, 0, 60) occur in neither.
"""

from __future__ import annotations

from dataclasses import dataclass

from gear.config.load import find_config
from gear.config.nodes import parse_file
from gear.config.reader import read_node
from gear.world.scene_spec import SceneLibrary

TOWNS = ("town10", "suburb", "harbour")
HELD_OUT_SCENES = (("town10", "billboard07"), ("suburb", "billboard05"))
HELD_OUT_WEATHER = "CloudyNoon"

WEATHERS = (
    "ClearNoon", "CloudySunset", "SoftRainNoon", "ClearNoon", "WetNoon", "ClearSunset", "ClearNoon", "MidRainyNoon",
    "CloudySunset", "HardRainNoon",
)  # fmt: skip
"""Dealt out in turn; the default weather comes more often."""

DRIVES_A_TOWN = 3
"""Collections without a board in each town: the ego car is anywhere in it."""

SHARES = {"no_billboard": 0.45, "board": 0.45, "truck": 0.1}
"""Of the training samples, by kind of scene."""

CROWDS = {"board": 2 / 3, "truck": 2 / 3}
"""Road users of the training streets, times those that the scenes have."""

CROWDED = ("semseg", "detect2d", "stereo3d")
"""Tasks whose training streets these are, and whose shipped networks learnt from them; depth has the scenes' own."""

FIRST_TRAINING_SEED, FIRST_HELD_OUT_SEED = 20_000, 30_000
HELD_OUT_SAMPLES = 300

FILM_EVERY = 3
"""Every third collection of a task whose samples cost much (large pictures, or two of them) is rendered as `film`, the
others as `fast`: more pictures in the same time, and networks that know both."""

COSTLY = ("semseg", "stereo3d")

TRAINING_OPTIONS: dict[str, tuple[str, ...]] = {
    "semseg": ("options.width_px=1536", "options.height_px=768", "options.polygons=false"),
    "detect2d": (
        "options.width_px=800",
        "options.height_px=480",
        "options.visibility.preset=carla_gear",
        "options.visibility.min_box_area_px2=324",
        "options.visibility.min_visible_px=36",
    ),
    "stereo3d": ("options.visibility.preset=carla_gear",),
    "depth": ("options.width_px=1224", "options.height_px=370"),
}
"""The options that the shipped networks' training data had. Segmentation has pictures of three quarters of the task's
size, detection of three fifths, with limits of visibility to match."""

HELD_OUT_OPTIONS: dict[str, tuple[str, ...]] = {
    "semseg": (),
    "detect2d": ("options.visibility.preset=carla_gear",),
    "stereo3d": ("options.visibility.preset=carla_gear",),
    "depth": ("options.width_px=1224", "options.height_px=370"),
}
"""The options of the data that the cards' figures were measured on."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Collection:
    """One `gear collect`.

    Attributes:
        task, town, scene, weather, split: as its flags.
        patch: `none` or `random`.
        seed: of the split, and of the random patch.
        samples: how many.
        settings: its `--set` texts.
    """

    task: str
    town: str
    scene: str
    weather: str
    split: str
    patch: str
    seed: int
    samples: int
    settings: tuple[str, ...]

    @property
    def name(self) -> str:
        """Of its folder."""
        return f"{self.town}-{self.scene}-{self.weather}-{self.patch}"

    def arguments(self) -> list[str]:
        """Of `gear collect`, without `--out`."""
        flags = {
            "task": self.task, "town": self.town, "scene": self.scene, "weather": self.weather, "split": self.split,
            "patch": self.patch, "seed": self.seed, "samples": self.samples,
        }  # fmt: skip
        settings = [*self.settings, f"patch_seed={self.seed}"]
        return [word for key, value in flags.items() for word in (f"--{key}", str(value))] + [
            word for setting in settings for word in ("--set", setting)
        ]


def training(task: str, samples: int) -> list[Collection]:
    """The training collections of a task, with about so many samples in all."""
    places = [(town, scene) for town in TOWNS for scene in scenes_of(town) if (town, scene) not in HELD_OUT_SCENES]
    drives = [place for place in places if place[1] == "no_billboard" for _ in range(DRIVES_A_TOWN)]
    boards = [place for place in places if place[1].startswith("billboard")]
    trucks = [place for place in places if place[1] == "truck"]
    counts = {kind: round(samples * share) for kind, share in SHARES.items()}
    result: list[Collection] = []
    for kind, members in (("no_billboard", drives), ("board", boards), ("truck", trucks)):
        for number, (town, scene) in enumerate(members):
            order = len(result)
            result.append(
                Collection(
                    task=task,
                    town=town,
                    scene=scene,
                    weather=WEATHERS[order % len(WEATHERS)],
                    split="train",
                    patch="none" if kind == "no_billboard" or number % 2 else "random",
                    seed=FIRST_TRAINING_SEED + order,
                    samples=max(1, round(counts[kind] / len(members))),
                    settings=(
                        *TRAINING_OPTIONS[task],
                        *([f"crowd={CROWDS[kind]:g}"] if task in CROWDED and kind in CROWDS else []),
                        *(["quality=fast"] if task in COSTLY and order % FILM_EVERY else []),
                    ),
                )
            )
    return result


def held_out(task: str, samples: int = HELD_OUT_SAMPLES, *, first_seed: int = FIRST_HELD_OUT_SEED) -> list[Collection]:
    """The collections that weights are measured on: both held-out scenes in a known and in the held-out weather."""
    pairs = [(place, weather) for place in HELD_OUT_SCENES for weather in ("ClearNoon", HELD_OUT_WEATHER)]
    return [
        Collection(
            task=task,
            town=town,
            scene=scene,
            weather=weather,
            split="test",
            patch="none",
            seed=first_seed + number,
            samples=max(1, round(samples / len(pairs))),
            settings=HELD_OUT_OPTIONS[task],
        )
        for number, ((town, scene), weather) in enumerate(pairs)
    ]


def scenes_of(town: str) -> list[str]:
    """Names of a town's scenes, in the order of its library."""
    library = read_node(SceneLibrary, parse_file(find_config("scenes", town)))
    return list(library.scenes)
