"""`gear collect --probes`: what is kept, that nothing else changes, and that it does not depend on who made it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gear
from gear.collecting.run import CollectReport
from gear.dataset.layout import CARDS
from gear.dataset.probe_files import probes_of
from gear.formats import rle
from gear.values.errors import DatasetError
from tests.dataset.splits import tree
from tests.verbs.conftest import Copy

Collect = Callable[..., CollectReport]


def without_gear(root: Path) -> dict[str, bytes]:
    """The files of the task: without gear's own, and without the card, which names their hashes."""
    return {name: data for name, data in tree(root).items() if not name.startswith("gear/") and name not in CARDS}


def test_probes_hold_the_reach_of_each_surface(tmp_path: Path, copy_small: Copy) -> None:
    copy_small("semseg", tmp_path, scene="double", probes=True)
    dataset = gear.open_dataset(tmp_path)
    assert dataset.verify() == []
    for index, sample in enumerate(dataset):
        probes = probes_of(dataset, index, "left")
        assert [probe.surface for probe in probes] == ["surface_0", "surface_1"]
        for probe, truth in zip(probes, sample.surfaces, strict=True):
            assert probe.black.dtype == probe.white.dtype == np.uint16
            height, width = probe.black.shape[:2]
            seen = rle.decode(truth.mask_rle, *sample.images["left"].shape[:2])
            inside = seen[probe.top_px : probe.top_px + height, probe.left_px : probe.left_px + width]
            assert inside.sum() == seen.sum() > 0, "the crop holds all that is seen of the surface"
            assert (probe.white.astype(int) - probe.black)[inside].min() > 20, "white gives light wherever it is seen"
            assert height * width < 4 * seen.sum(), "and not much else"


def test_pictures_and_labels_do_not_depend_on_probes(tmp_path: Path, copy_small: Copy) -> None:
    copy_small("semseg", tmp_path / "with", probes=True)
    copy_small("semseg", tmp_path / "without")
    assert without_gear(tmp_path / "with") == without_gear(tmp_path / "without")
    with_probes, without = gear.open_dataset(tmp_path / "with"), gear.open_dataset(tmp_path / "without")
    assert with_probes.plan.twin_key == without.plan.twin_key
    assert with_probes.plan.content_key != without.plan.content_key
    copy_small("semseg", tmp_path / "random", patch="random")
    assert len(gear.open_twins(tmp_path / "with", tmp_path / "random")) == 2


def test_without_probes_nothing_speaks_of_them(tmp_path: Path, copy_small: Copy) -> None:
    copy_small("depth", tmp_path)
    for name, data in tree(tmp_path).items():
        if name.endswith(".json"):
            assert b"probes" not in data and b"auxiliary" not in data, name


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_probes_do_not_depend_on_the_worker(tmp_path: Path, collect_small: Collect, workers: int) -> None:
    collect_small("stereo3d", tmp_path / "straight", samples=3, probes=True)
    collect_small("stereo3d", tmp_path / "taken_up", samples=1, probes=True)
    collect_small("stereo3d", tmp_path / "taken_up", samples=3, probes=True, workers=workers)
    assert tree(tmp_path / "straight") == tree(tmp_path / "taken_up")
    sidecar = json.loads((tmp_path / "straight/gear/debug/samples/000000.json").read_text())
    assert {name.split("/")[1] for name in sidecar["auxiliary"]} == {"left", "right"}
    assert {file["path"] for file in sidecar["auxiliary"].values()} <= set(sidecar["files"])


def test_a_split_without_probes_gets_none_by_and_by(tmp_path: Path, collect_small: Collect, copy_small: Copy) -> None:
    copy_small("depth", tmp_path)
    with pytest.raises(DatasetError, match=r"another configuration \(auxiliary"):
        collect_small("depth", tmp_path, probes=True)
    with pytest.raises(DatasetError, match="has no probes; collect it with --probes"):
        probes_of(gear.open_dataset(tmp_path), 0, "left")
    collect_small("depth", tmp_path, probes=True, force=True)
    assert probes_of(gear.open_dataset(tmp_path), 0, "left")
    collect_small("depth", tmp_path, force=True)
    assert not list(tmp_path.rglob("*white.png")), "what --force replaces is gone, probes too"


def test_a_scene_without_surfaces_has_no_probes(tmp_path: Path, collect_small: Collect) -> None:
    collect_small("depth", tmp_path, scene="no_billboard", probes=True)
    dataset: Any = gear.open_dataset(tmp_path)
    assert probes_of(dataset, 0, "left") == ()


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda file: file["facts"].pop("left_px"), "facts|left_px: missing"),
        (lambda file: file["facts"].update(left_px=-1), "does not lie in the picture"),
        (lambda file: file["facts"].update(top_px=10**6), "does not lie in the picture"),
        (lambda file: file["facts"]["response"].update(contrast=9), "contrast must be 0.5 to 2"),
        (lambda file: file["facts"].update(response=[]), "response: expected a mapping"),
        (lambda file: file.update(facts=None), "expected a mapping, got None"),
    ],
)
def test_a_sidecar_that_says_something_else_of_a_probe_is_one_line(
    tmp_path: Path, copy_small: Copy, change: Callable[[Any], object], problem: str
) -> None:
    copy_small("depth", tmp_path, samples=1, probes=True)
    path = tmp_path / "gear/debug/samples/000000.json"
    content = json.loads(path.read_text())
    for file in content["auxiliary"].values():
        change(file)
    path.write_text(json.dumps(content))
    with pytest.raises(
        DatasetError, match=rf"000000.json: .*({problem}).*; delete it and run the same collection again$"
    ):
        probes_of(gear.open_dataset(tmp_path), 0, "left")


@pytest.mark.parametrize("compositor", ["transport", "homography"])
def test_a_sidecar_without_a_surfaces_measures_is_one_line(tmp_path: Path, copy_small: Copy, compositor: str) -> None:
    import torch

    from gear.compositor.registry import open_compositor

    copy_small("depth", tmp_path, samples=1, probes=True)
    path = tmp_path / "gear/debug/samples/000000.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"surfaces": []}))
    dataset = gear.open_dataset(tmp_path)
    with pytest.raises(DatasetError, match=r"000000\.json: does not say where surface_0 is in view 'left'; delete it"):
        open_compositor(compositor, dataset).compose([torch.zeros(3, 4, 8)], [0], "left")
