"""The data of the reference weights: scenes, weathers, patches and seeds for training, and those that are held out.

Two scenes (town10's billboard07, suburb's billboard05) and one weather (CloudyNoon) are held out: no network is trained
on them, and no checkpoint is chosen by them. Training has the seeds 20000 to 20999, held-out collections have 30000
to 30999. The seeds of the paper's splits (123, 131, 363, 0, 60) are not used.
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
"""Weathers of the training collections, used in turn; the default weather occurs more often."""

DRIVES_A_TOWN = 3
"""Number of collections without a board in each town; the ego car starts anywhere in the town."""

SHARES = {"no_billboard": 0.45, "board": 0.45, "truck": 0.1}
"""Share of the training samples by kind of scene."""

CROWDS = {"board": 2 / 3, "truck": 2 / 3}
"""Factor on the number of road users of the scenes, by kind of scene."""

CROWDED = ("semseg", "detect2d", "stereo3d")
"""Tasks for which `CROWDS` applies; pictures for depth have the scenes' own number of road users."""

FIRST_TRAINING_SEED, FIRST_HELD_OUT_SEED = 20_000, 30_000
HELD_OUT_SAMPLES = 300

FILM_EVERY = 3
"""One collection in this many is rendered as `film`, the others as `fast`, for tasks with expensive samples.

This gives more pictures in the same time, and networks that are trained on both qualities.
"""

COSTLY = ("semseg", "stereo3d")
"""Tasks with expensive samples: large pictures, or two pictures per sample."""

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
"""Options of the training data of the shipped networks, by task.

The width of pictures is three quarters of the task's default for segmentation, and three fifths for detection, with
limits of visibility that fit this size.
"""

HELD_OUT_OPTIONS: dict[str, tuple[str, ...]] = {
    "semseg": (),
    "detect2d": ("options.visibility.preset=carla_gear",),
    "stereo3d": ("options.visibility.preset=carla_gear",),
    "depth": ("options.width_px=1224", "options.height_px=370"),
}
"""Options of the data on which the metrics in the networks' cards are measured, by task."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Collection:
    """The arguments of one `gear collect`.

    Attributes:
        task, town, scene, weather, split: values of the flags with these names.
        patch: `none` or `random`.
        seed: seed of the split, and of the random patch.
        samples: number of samples.
        settings: values of `--set`.
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
        """Name of the folder of the collection."""
        return f"{self.town}-{self.scene}-{self.weather}-{self.patch}"

    def arguments(self) -> list[str]:
        """Returns the arguments of `gear collect`, without `--out`."""
        flags = {
            "task": self.task, "town": self.town, "scene": self.scene, "weather": self.weather, "split": self.split,
            "patch": self.patch, "seed": self.seed, "samples": self.samples,
        }  # fmt: skip
        settings = [*self.settings, f"patch_seed={self.seed}"]
        return [word for key, value in flags.items() for word in (f"--{key}", str(value))] + [
            word for setting in settings for word in ("--set", setting)
        ]


def training(task: str, samples: int) -> list[Collection]:
    """Returns the training collections of a task, with about `samples` samples in total."""
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
    """Returns the collections on which weights are measured: both held-out scenes, in ClearNoon and in the held-out
    weather.

    Args:
        task: name of the task.
        samples: approximate number of samples in total.
        first_seed: seed of the first collection.
    """
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
    """Returns the names of a town's scenes, in the order of its file."""
    library = read_node(SceneLibrary, parse_file(find_config("scenes", town)))
    return list(library.scenes)
