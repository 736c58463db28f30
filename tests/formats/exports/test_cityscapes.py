import contextlib
import gc
import importlib
import io
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from gear.networks.torchvision_import import prepare
from gear.plugins.datasets import open_dataset
from gear.verbs.export import export
from tests.formats.exports.trees import dataset

official = importlib.import_module("cityscapesscripts.helpers.labels")

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
"""torchvision leaves its files open."""


@pytest.fixture(autouse=True)
def closed_files() -> Iterator[None]:
    yield
    gc.collect()


def test_torchvision_reads_it(tmp_path: Path) -> None:
    prepare()
    from torchvision.datasets import Cityscapes

    data = dataset(tmp_path / "data", "semseg", ("train", "val"))
    assert export(data, layout="cityscapes", out=tmp_path / "city") == 4
    for split in ("train", "val"):
        kinds = ["semantic", "instance", "color", "polygon"]
        read = Cityscapes(str(tmp_path / "city"), split=split, mode="fine", target_type=kinds)
        ours = open_dataset(data, split)
        assert len(read) == len(ours) == 2
        for number, path in enumerate(read.images):  # in the order of the folder, which is none
            sequence = int(Path(path).name.split("_")[1])
            sample = next(one for one in ours if one.record.sequence == sequence)
            picture, (labels, instances, _, polygon) = read[number]
            assert np.array_equal(np.asarray(picture), sample.images["left"])
            assert np.array_equal(np.asarray(labels), sample.label_ids)
            assert np.array_equal(np.asarray(instances), sample.instance_ids)
            assert polygon["imgWidth"] == 320 and polygon["objects"]


def test_train_ids_are_those_of_the_official_table(tmp_path: Path) -> None:
    data = dataset(tmp_path / "data", "semseg", polygons=False)
    export(data, layout="cityscapes", out=tmp_path / "city")
    (first, _) = sorted((tmp_path / "city/gtFine/val").rglob("*_gtFine_labelTrainIds.png"))
    assert not list((tmp_path / "city").rglob("*_polygons.json"))
    found = cv2.imread(str(first), cv2.IMREAD_UNCHANGED)
    labels = open_dataset(data)[0].label_ids
    assert len(np.unique(found)) > 3
    for label in np.unique(labels):
        assert set(found[labels == label]) == {official.id2label[int(label)].trainId}


def test_splits_of_other_names_have_their_own_city_in_one_of_the_three(tmp_path: Path) -> None:
    data = dataset(tmp_path / "data", "semseg", ("val", "val_night", "debug", "train_x"))
    export(data, layout="cityscapes", out=tmp_path / "city")
    cities = sorted(path.relative_to(tmp_path / "city/leftImg8bit").as_posix() for path in (
        tmp_path / "city/leftImg8bit").glob("*/*"))  # fmt: skip
    assert cities == [
        "train/geartown10trainxaachen", "val/geartown10aachen", "val/geartown10debugaachen",
        "val/geartown10valnightaachen",
    ]  # fmt: skip
    assert all(len(list(path.iterdir())) == 2 for path in (tmp_path / "city/leftImg8bit").glob("*/*"))


def test_the_official_evaluation_finds_ground_truth_perfect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(np, "in1d", lambda a, b, **k: np.isin(np.ravel(a), b, **k), raising=False)
    monkeypatch.setenv("CITYSCAPES_DATASET", str(tmp_path / "city"))
    script = importlib.import_module("cityscapesscripts.evaluation.evalPixelLevelSemanticLabeling")
    data = dataset(tmp_path / "data", "semseg", ("val", "debug"))
    export(data, layout="cityscapes", out=tmp_path / "city")
    truths = sorted(str(path) for path in (tmp_path / "city").glob("gtFine/*/*/*_gtFine_labelIds.png"))
    assert len(truths) == 4
    arguments = script.args
    arguments.evalLabels = [label.id for label in official.labels if label.id >= 0]
    arguments.JSONOutput, arguments.quiet = False, True
    with contextlib.redirect_stdout(io.StringIO()):
        result = script.evaluateImgLists(truths, truths, arguments)
    assert result["averageScoreClasses"] == pytest.approx(1.0)
    assert result["averageScoreInstClasses"] == pytest.approx(1.0)
