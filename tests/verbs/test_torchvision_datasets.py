"""torchvision's own dataset classes read what gear writes."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import gear
from gear.networks.torchvision_import import prepare
from gear.verbs.export import export
from tests.verbs.conftest import Copy

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
"""It leaves its files open."""


@pytest.fixture(autouse=True)
def collected_here() -> Iterator[None]:
    """What it left open is closed while that is still forgiven."""
    yield
    gc.collect()


def test_cityscapes(copy_small: Copy, tmp_path: Path) -> None:
    prepare()
    from torchvision.datasets import Cityscapes

    copy_small("semseg", tmp_path, split="val")
    read = Cityscapes(str(tmp_path), split="val", mode="fine", target_type=["semantic", "instance", "color", "polygon"])
    ours = gear.open_dataset(tmp_path)
    assert len(read) == len(ours) == 2
    for index, sample in enumerate(ours):
        picture, (labels, instances, _, polygon) = read[index]
        assert np.array_equal(np.asarray(picture), sample.images["left"])
        assert np.array_equal(np.asarray(labels), sample.label_ids)
        assert np.array_equal(np.asarray(instances), sample.instance_ids)
        assert polygon["imgWidth"] == 320 and polygon["objects"]


def test_coco(copy_small: Copy, tmp_path: Path) -> None:
    prepare()
    from torchvision.datasets import CocoDetection

    copy_small("detect2d", tmp_path, split="val")
    ours = gear.open_dataset(tmp_path)
    read = CocoDetection(str(tmp_path / "images" / "val"), str(tmp_path / "annotations" / "instances_val.json"))
    assert len(read) == 2
    for index, sample in enumerate(ours):
        picture, annotations = read[index]
        assert np.array_equal(np.asarray(picture), sample.images["left"])
        assert len(annotations) == len(sample.objects)
        for annotation, found in zip(annotations, sample.objects, strict=True):
            left, top, width, height = annotation["bbox"]
            assert np.allclose((left, top, left + width, top + height), found.box_px)


def test_kitti(copy_small: Copy, tmp_path: Path) -> None:
    prepare()
    from torchvision.datasets import Kitti

    copy_small("stereo3d", tmp_path / "data", split="val")
    ours = gear.open_dataset(tmp_path / "data")
    export(tmp_path / "data", layout="kitti", out=tmp_path / "Kitti" / "raw")
    read = Kitti(str(tmp_path), train=True)
    assert len(read) == 2
    for number, path in enumerate(read.images):  # in the order of the folder, which is none
        sample = ours[int(Path(path).stem)]
        picture, target = read[number]
        assert np.array_equal(np.asarray(picture), sample.images["left"])
        # The exported tree lists ignored regions last, as the benchmark does.
        types = [found.label().type for found in sample.objects]
        assert [one["type"] for one in target] == sorted(types, key=lambda one: one == "DontCare")
