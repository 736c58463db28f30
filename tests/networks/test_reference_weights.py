"""The reference weights as they lie in the weights package: whole, said where from, small enough, and good."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import shapely

import gear
from gear.contracts.models import Model
from gear.dataset.files import sha256
from gear.formats.kitti_object import KittiLabel
from gear.networks.segmentation.ddrnet import DDRNet23Slim
from gear.networks.shipped import CHECKOUT, inspect
from gear.networks.weights import load_trunk, mismatches, read
from gear.plugins.build import NO_OPTIONS, build, find
from gear.verbs.collect.run import collect
from gear.verbs.evaluate.run import evaluate

FILES = sorted((CHECKOUT / "models").glob("*.safetensors"))
TEXTS = {"model", "task", "gear", "command", "seed", "look", "look_hash", "data", "metrics", "intervals"}
LARGEST_PACKAGE_BYTES = 90e6
HOME = re.compile(r"/(?:tmp|home|root|work|Users|mnt)/")

named = pytest.mark.parametrize("path", FILES, ids=[path.stem for path in FILES])


def test_the_package_is_small() -> None:
    size = sum(path.stat().st_size for path in CHECKOUT.rglob("*") if path.is_file())
    assert FILES and size <= LARGEST_PACKAGE_BYTES


@named
def test_a_file_says_where_it_comes_from(path: Path) -> None:
    file = inspect(path)
    assert file.metadata.keys() >= TEXTS and file.metadata["model"] == path.stem
    assert not any(HOME.search(text) for text in file.metadata.values())
    facts = file.facts()
    assert facts["metrics"] and facts["metrics"].keys() == facts["intervals"].keys()  # type: ignore[union-attr]
    assert find("model", path.stem).spec.tasks[0] == facts["task"]


@named
def test_its_card_is_of_this_file(path: Path) -> None:
    card = path.with_suffix(".md").read_text()
    assert sha256(path.read_bytes()) in card and f"# {path.stem} for " in card
    assert not HOME.search(card)


@named
def test_the_network_takes_them(path: Path) -> None:
    model: Model = build(find("model", path.stem), NO_OPTIONS)
    state = model.module().state_dict()  # type: ignore[attr-defined]
    given, _ = read(path)
    assert mismatches(state, given) == []
    assert all(bool((state[key].cpu() == value).all()) for key, value in given.items())


UNSEEN: dict[str, tuple[str, dict[str, tuple[float, float]]]] = {
    "bisenet_x39": ("reference", {"iou_road": (0.7, 1), "iou_building": (0.5, 1), "iou_sky": (0.7, 1)}),
    "glpn_b0": ("reference", {"d1": (0.5, 1), "rmse_m": (0, 14)}),
    "adabins_lite0": ("reference", {"d1": (0.6, 1), "rmse_m": (0, 12)}),
    "ddrnet23_slim_depth": ("reference", {"d1": (0.75, 1), "rmse_m": (0, 10)}),
    "ddrnet23_slim": (
        "reference",
        {"iou_road": (0.85, 1), "iou_building": (0.75, 1), "iou_sky": (0.85, 1), "iou_car": (0.3, 1)},
    ),
    "stereo_centre_lite0": ("task", {"pedestrian_2d_moderate_r40": (0.05, 1)}),  # at most n of 40 where n stand
    "fasterrcnn_lite0_fpn": ("task", {"ap50": (0.15, 1)}),  # there are too few of everything for the other report
    "retinanet_lite0_fpn": ("task", {"ap50": (0.25, 1)}),
}
"""Between what each network's metrics must lie on two pictures of a street and weather that it never saw; it does far
better than the worse of them."""


FARTHEST_OFF = 0.05
"""Median of how far objects that a stereo network finds are off, as a share of their distance."""


def found_pairs(data: Path, name: str) -> list[tuple[KittiLabel, KittiLabel]]:
    """Labels of a stereo dataset with what the network finds where they are in the picture."""
    model: Model = build(find("model", name), NO_OPTIONS)
    return [
        (label, found)
        for sample in gear.open_dataset(data)
        for predicted in [model.predict(sample.images)]  # type: ignore[attr-defined]
        for label in (thing.label() for thing in sample.objects)
        for found in predicted
        if label.type == found.type and overlap(label.box_px, found.box_px) > 0.5
    ]


def overlap(one: Sequence[float], other: Sequence[float]) -> float:
    first, second = shapely.box(*one), shapely.box(*other)
    return float(first.intersection(second).area / first.union(second).area)


@pytest.mark.slow
@named
def test_networks_work_on_a_street_outside_their_training_data(path: Path, tmp_path: Path) -> None:
    task = find("model", path.stem).spec.tasks[0]
    collect(
        task, town="suburb", scene="no_billboard", split="debug", seed=51_234, samples=2, weather="CloudyNoon",
        out=tmp_path / "data",
    )  # fmt: skip
    report = evaluate(tmp_path / "data", model=path.stem, reports=["reference"], out=tmp_path / "out")
    name, bounds = UNSEEN[path.stem]
    metrics = report.rows[0].metrics[name]
    assert all(low < metrics[key].value < high for key, (low, high) in bounds.items()), metrics
    if task == "stereo3d":
        pairs = found_pairs(tmp_path / "data", path.stem)
        off = [abs(found.location_m[2] / label.location_m[2] - 1) for label, found in pairs]
        taller_m = [abs(found.height_m - label.height_m) for label, found in pairs]
        assert len(pairs) >= 8 and np.median(off) < FARTHEST_OFF and np.median(taller_m) < 0.2, pairs


def test_depth_has_a_trunk_for_segmentation() -> None:
    """What docs/how-to/train.md says: all but the heads of ddrnet23_slim can begin with what depth has taught."""
    loaded, total = load_trunk(DDRNet23Slim(19), CHECKOUT / "models" / "ddrnet23_slim_depth.safetensors")
    assert 0.95 * total < loaded < total
