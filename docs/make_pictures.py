"""Makes the pictures of the README and the documents: `python docs/make_pictures.py [NAME ...]`.

The pictures come from collections with fixed seeds and take some minutes on two cores. When the appearance of the towns
has changed visibly, make them again, look at them and commit them.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

import gear
from gear.formats import cityscapes
from gear.measuring.guarded_model import GuardedModel
from gear.measuring.plugin_selection import chosen_model
from gear.plugins.build import NO_OPTIONS, build, find

Picture = npt.NDArray[np.uint8]

IMAGES = Path(__file__).parent / "images"
QUALITY = 88
WORKERS = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Shot:
    """One picture of a street.

    Attributes:
        town, scene, weather: where and in what.
        seed: of the split.
        index: of the sample in it.
        patch, task: as `gear collect` takes them.
    """

    town: str
    seed: int
    index: int
    scene: str = "no_billboard"
    weather: str = "ClearNoon"
    patch: str = "none"
    task: str = "semseg"

    def taken(self, root: Path) -> Any:
        """The sample, collected below `root`."""
        out = root / "-".join([self.task, self.town, self.scene, self.weather, str(self.seed), self.patch])
        gear.collect(
            self.task, town=self.town, scene=self.scene, weather=self.weather, seed=self.seed, patch=self.patch,
            samples=self.index + 1, out=out, workers=WORKERS,
        )  # fmt: skip
        return gear.open_dataset(out)[self.index]


BY_DAY = (
    Shot(town="town10", seed=9001, index=6),
    Shot(town="suburb", seed=9001, index=3),
    Shot(town="harbour", seed=9001, index=6),
)
WEATHERS = (
    Shot(town="town10", seed=9001, index=1, weather="ClearSunset"),
    Shot(town="town10", seed=9001, index=9, weather="HardRainNoon"),
    Shot(town="suburb", seed=9001, index=4, weather="CloudySunset"),
)
PATCHES = ("ddrnet23_slim-town10-billboard05", "ddrnet23_slim-suburb-billboard06")
BY_NIGHT = (
    Shot(town="town10", seed=9003, index=1, scene="billboard05", weather="ClearNight", patch=PATCHES[0]),
    Shot(town="town10", seed=9001, index=3, weather="WetNight"),
    Shot(town="suburb", seed=9001, index=3, weather="ClearNight"),
    Shot(town="town10", seed=9001, index=10, weather="SoftRainNight"),
    Shot(town="harbour", seed=9001, index=6, weather="WetNight"),
    Shot(town="suburb", seed=9003, index=1, scene="billboard06", weather="CloudyNight", patch=PATCHES[1]),
)  # fmt: skip
DEPTH_MODEL = "ddrnet23_slim_depth"
DEPTH_PATCH = f"{DEPTH_MODEL}-town10-billboard05"
PATCHED = Shot(task="depth", town="town10", seed=9003, index=5, scene="billboard05")


def towns(root: Path) -> Picture:
    """Streets of the three towns, their labels, and other weathers."""
    by_day = [shot.taken(root) for shot in BY_DAY]
    labels = [cityscapes.colour_map(sample.label_ids)[..., :3] for sample in by_day]
    others = [shot.taken(root).images["left"] for shot in WEATHERS]
    return grid([[sample.images["left"] for sample in by_day], labels, others], width_px=560)


def night(root: Path) -> Picture:
    """The towns at night."""
    pictures = [shot.taken(root).images["left"] for shot in BY_NIGHT]
    return grid([pictures[i : i + 2] for i in range(0, len(pictures), 2)], width_px=720)


def patch(root: Path) -> Picture:
    """A street without and with patches, and the depth that the network sees in each."""
    samples = [PATCHED.taken(root), replace(PATCHED, patch=DEPTH_PATCH).taken(root)]
    guarded = GuardedModel(chosen_model(DEPTH_MODEL, ()))
    answers = guarded.predict([sample.images for sample in samples], range(len(samples)))
    task = build(find("task", "depth"), NO_OPTIONS)
    seen = [
        task.preview(replace(sample, depth_m=answer.prediction))["depth"]
        for sample, answer in zip(samples, answers, strict=True)
    ]
    return grid([[sample.images["left"] for sample in samples], seen], width_px=820)


def grid(rows: Sequence[Sequence[Picture]], *, width_px: int) -> Picture:
    """Pictures in rows and columns, each `width_px` wide."""
    shrunk = [
        [
            cv2.resize(one, (width_px, round(width_px * one.shape[0] / one.shape[1])), interpolation=cv2.INTER_AREA)
            for one in row
        ]
        for row in rows
    ]
    return np.vstack([np.hstack(row) for row in shrunk]).astype(np.uint8)


PICTURES: dict[str, Callable[[Path], Picture]] = {"towns": towns, "night": night, "patch": patch}


def main() -> None:
    """Makes the pictures that are named, or all."""
    for name in sys.argv[1:] or PICTURES:
        with tempfile.TemporaryDirectory() as folder:
            picture = PICTURES[name](Path(folder))
        path = IMAGES / f"{name}.jpg"
        cv2.imwrite(str(path), picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        print(path)


if __name__ == "__main__":
    main()
