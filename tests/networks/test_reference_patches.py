"""The patches in the weights package: made against the weights beside them or measured with those, and harmful."""

from __future__ import annotations

import functools
import json
import re
from collections import Counter
from pathlib import Path

import cv2
import pytest

from authoring.weights.patches.plan import patched_scenes
from authoring.weights.plan import TOWNS
from gear.measuring.guarded_model import weights_digest
from gear.networks.shipped import CHECKOUT
from gear.plugins.build import NO_OPTIONS, build, find

FOLDERS = sorted(path.parent for path in (CHECKOUT / "patches").glob("*/attack.json"))
HOME = re.compile(r"/(?:tmp|home|root|work|Users|mnt)/")
SHARE_OF_SCENES = 0.2
NETWORKS = {
    "semseg": "ddrnet23_slim",
    "depth": "ddrnet23_slim_depth",
    "detect2d": "retinanet_lite0_fpn",
}
"""Each has a patch in every scene with a surface."""

ALSO = {"stereo_centre_lite0": "town10", "adabins_lite0": "town10", "glpn_b0": "town10"}
"""Further networks, with the town in whose scenes each has a patch."""

FELT = 0.005
"""Of a figure that a patch changes by less, no share can be asked for."""

named = pytest.mark.parametrize("folder", FOLDERS, ids=[folder.name for folder in FOLDERS])


@functools.cache
def digest(model: str) -> str | None:
    return weights_digest(build(find("model", model), NO_OPTIONS))


@named
def test_a_patch_is_made_against_the_weights_that_are_shipped_or_measured_with_them(folder: Path) -> None:
    text, effect = (folder / "attack.json").read_text(), json.loads((folder / "effect.json").read_text())
    attack = json.loads(text)
    (model,) = [one["name"] for one in attack["models"]]
    assert folder.name.startswith(f"{model}-") and not HOME.search(text)
    assert effect["weights_sha256"] == attack["weights_sha256"]
    assert effect.get("again", effect)["weights_sha256"] == digest(model)
    for index in range(len(attack["patches"])):
        picture = cv2.imread(str(folder / f"patch_{index}.png"))
        options = attack["attack"]["options"]
        assert picture is not None and picture.shape == (options["height_px"], options["width_px"], 3)


@named
def test_the_digital_patch_was_the_rendered_one(folder: Path) -> None:
    made = json.loads((folder / "effect.json").read_text())
    for effect in (made, made.get("again", {})):
        if "effect" in effect:
            done = effect["effect"]
            assert effect["psnr_db"] >= 40 and (abs(done["digital"]) < FELT or done["share"] >= 0.9)


def test_every_scene_has_a_patch_against_every_reference_network() -> None:
    places = [f"{town}-{scene}" for town in TOWNS for scene in patched_scenes(town)]
    expected = {f"{model}-{place}" for model in NETWORKS.values() for place in places}
    expected |= {f"{model}-{town}-{scene}" for model, town in ALSO.items() for scene in patched_scenes(town)}
    assert {folder.name for folder in FOLDERS} == expected


def test_tasks_have_scenes_where_the_optimised_patch_is_worse_than_noise() -> None:
    """Outside the patch, by the paired test over unseen pictures; in the task's figure; and rendered as digitally."""
    convincing, scenes = Counter[str](), Counter[str]()
    for folder in FOLDERS:
        made = json.loads((folder / "effect.json").read_text())
        effect = made | made.get("again", {})
        outside, figure, done = effect["outside"], effect["metric"], effect["effect"]
        scenes[made["task"]] += 1
        convincing[made["task"]] += (
            outside["p"] < 0.01
            and outside["mean"] < 0
            and figure["patched"] < figure["random"]
            and done["digital"] <= -FELT
            and done["share"] >= 0.9
        )
    assert scenes.keys() == {*NETWORKS, "stereo3d"}
    assert all(convincing[task] >= SHARE_OF_SCENES * scenes[task] for task in scenes), (convincing, scenes)
