"""Datasets in FiftyOne, with the real package and its database where both are installed."""

from __future__ import annotations

import builtins
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import gear
from gear.values.errors import DatasetError, GearError

NAME = "gear tests"


@pytest.fixture
def fiftyone() -> Iterator[Any]:
    """The package with a running database; datasets that a test made are deleted."""
    package = pytest.importorskip("fiftyone", exc_type=ImportError)
    before = set(package.list_datasets())
    yield package
    for name in set(package.list_datasets()) - before:
        package.delete_dataset(name)


@pytest.mark.filterwarnings("ignore")
def test_a_dataset_of_every_task_opens(fiftyone: Any, write_dataset: Any) -> None:
    fields = {"detect2d": "objects", "semseg": "labels", "stereo3d": "boxes_3d", "depth": "depth"}
    for task, field in fields.items():
        root = write_dataset(task, 2)
        made, dataset = gear.to_fiftyone(root, NAME, overwrite=True), gear.open_dataset(root)
        cameras = list(dataset[0].images)
        assert (made.name, len(made)) == (NAME, 2 * len(cameras))
        assert [one.camera for one in made] == cameras * 2
        first = made.first()
        picture = cv2.imread(first.filepath)[..., ::-1]
        assert np.array_equal(picture, dataset[0].images[first.camera])
        assert (first.metadata.width, first.metadata.height) == picture.shape[1::-1]
        assert first[field] is not None and first.patches is not None
        assert first.weather_parameters.sun_altitude_deg == dataset[0].record.weather.sun_altitude_deg
        assert len(made.match(fiftyone.ViewField("weather") == first.weather)) == len(made)


@pytest.mark.filterwarnings("ignore")
def test_twins_come_with_their_evaluations(fiftyone: Any, twins: Any) -> None:
    made = gear.to_fiftyone(twins.none, twins=[twins.patched], evaluations=[twins.evaluation], samples=3)
    assert made.name == "gear none" and made.distinct("patch") == ["none", "odd"] and len(made) == 6
    assert len(made.group_by("index")) == 3
    name = next(field for field in made.get_field_schema() if field.startswith("prediction_")).partition("_")[2]
    clean, patched = (made.match(fiftyone.ViewField("patch") == patch).first() for patch in ("none", "odd"))
    assert len(clean[f"prediction_{name}"].detections) > len(patched[f"prediction_{name}"].detections) == 1
    assert "hidden" in {one.label for one in patched[f"changes_{name}"].detections}
    results = made.match(fiftyone.ViewField("patch") == "none").evaluate_detections(
        f"prediction_{name}", gt_field="objects", method="coco", iscrowd="iscrowd", compute_mAP=True
    )
    assert results.mAP() == pytest.approx(1.0)  # the network finds every object


@pytest.mark.filterwarnings("ignore")
def test_a_dataset_of_the_same_name_is_kept_unless_it_is_to_be_replaced(
    fiftyone: Any, write_dataset: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = write_dataset("depth", 2)
    gear.to_fiftyone(root, NAME, samples=1)
    with pytest.raises(GearError, match="give another name, or overwrite=True"):
        gear.to_fiftyone(root, NAME)
    before = fiftyone.list_datasets()
    picture = next(root.glob("leftImg8bit/*/*1.png"))
    picture.write_bytes(b"damaged")
    with pytest.raises(DatasetError, match="damaged"):
        gear.to_fiftyone(root, NAME, overwrite=True)
    assert fiftyone.list_datasets() == before and len(fiftyone.load_dataset(NAME)) == 1


def test_without_fiftyone_it_is_one_line(monkeypatch: pytest.MonkeyPatch, write_dataset: Any) -> None:
    load = builtins.__import__

    def missing(name: str, *given: Any, **named: Any) -> Any:
        if name == "fiftyone":
            raise ImportError(name)
        return load(name, *given, **named)

    root: Path = write_dataset("depth", 1)
    monkeypatch.setattr(builtins, "__import__", missing)
    with pytest.raises(GearError, match=r"pip install 'mujoco-gear\[fiftyone\]'"):
        gear.to_fiftyone(root)


def test_a_database_that_does_not_start_is_one_line(monkeypatch: pytest.MonkeyPatch, write_dataset: Any) -> None:
    load = builtins.__import__

    def broken(name: str, *given: Any, **named: Any) -> Any:
        if name == "fiftyone":
            raise RuntimeError("no database\nfurther lines")
        return load(name, *given, **named)

    root: Path = write_dataset("depth", 1)
    monkeypatch.setattr(builtins, "__import__", broken)
    with pytest.raises(GearError, match=r"fiftyone does not start: RuntimeError: no database$"):
        gear.to_fiftyone(root)
