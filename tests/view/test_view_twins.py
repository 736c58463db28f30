"""Pages of twins and evaluations: which pictures, changes and errors they hold."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import gear
from gear.contracts.legends import ColourNames
from gear.plugins.prediction_pictures import label_colour, label_colours, picture_legends, prediction_pictures
from gear.plugins.stored_evaluations import is_evaluation, open_evaluation
from gear.plugins.tasks.common import category_colour
from gear.plugins.tasks.stereo3d import COLOURS
from gear.values.errors import DatasetError
from gear.view.changes import picture_change
from gear.view.sources import unique
from gear.view.streets import streets
from gear.view.write import write_view

from .test_view_page import Blocks

FOUND = ("image", "preview", "prediction", "defended")


def page_of(tmp_path: Path, *arguments: Any, **named: Any) -> Blocks:
    report = write_view(*arguments, tmp_path / "page.html", **named)
    assert report.problems == ()
    return Blocks(tmp_path / "page.html")


def kinds(page: Blocks) -> list[tuple[str, str, str, str]]:
    return [tuple(channel.values()) for channel in page.index["channels"]]


def test_twins_and_evaluations_stand_side_by_side(twins: Any, tmp_path: Path) -> None:
    page = page_of(tmp_path, twins.none, twins=[twins.patched], evaluations=[twins.evaluation, twins.defended])
    odd, guarded = "odd", "odd + jpeg"
    assert kinds(page) == [
        ("image", "left", "none", ""), ("image", "left", odd, ""), ("preview", "boxes", "none", ""),
        *(("prediction", "objects", data, run) for data in ("none", odd) for run in (odd, guarded)),
        ("defended", "left", "none", guarded), ("defended", "left", odd, guarded),
    ]  # fmt: skip
    clean, patched = gear.open_dataset(twins.none), gear.open_dataset(twins.patched)
    for number, (one, other) in enumerate(zip(clean, patched, strict=True)):
        for place, pixels in ((0, one.images["left"]), (1, other.images["left"])):
            assert np.abs(page.picture(number, place).astype(int) - pixels).mean() < 12
        changes = page.index["samples"][number]["compared"]["pictures"]
        assert changes == {"odd": pytest.approx(picture_change(one, other))}
        assert changes["odd"] > 0
        ruined = cv2.imdecode(
            cv2.imencode(".jpg", other.images["left"][..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 5])[1], cv2.IMREAD_COLOR
        )[..., ::-1]
        shown = page.picture(number, 8).astype(int)  # half as wide
        halves = [cv2.resize(one, (200, 120), interpolation=cv2.INTER_AREA) for one in (ruined, other.images["left"])]
        assert np.abs(shown - halves[0]).mean() < np.abs(shown - halves[1]).mean()
    assert [s["compared"]["pictures"]["odd"] for s in page.index["samples"]] == sorted(
        s["compared"]["pictures"]["odd"] for s in page.index["samples"]
    )


def test_the_changes_are_those_of_the_evaluation(twins: Any, tmp_path: Path) -> None:
    page = page_of(tmp_path, twins.none, twins=[twins.patched], evaluations=[twins.evaluation])
    results = json.loads((twins.evaluation / "results.json").read_text())
    wanted = results["differences"][0]["objects"]["changes"]
    assert {one["change"] for one in wanted} == {"hidden"} and len(wanted) >= 4
    seen = [(n, one) for n, sample in enumerate(page.index["samples"]) for one in sample["compared"]["objects"]]
    assert [(n, one["change"], one["label"]) for n, one in seen] == [
        (one["sample"], one["change"], one["label"]) for one in wanted
    ]
    assert {(one["evaluation"], one["dataset"], one["against"]) for _, one in seen} == {("odd", "odd", "none")}
    for row, label in zip(results["rows"], ("none", "odd"), strict=True):
        for number, sample in enumerate(row["per_sample"]):
            assert page.index["samples"][number]["compared"]["metrics"]["odd"][label] == sample["metrics"]["task"]


def test_a_folder_and_an_evaluation_open_all_their_twins(twins: Any, tmp_path: Path) -> None:
    data = tmp_path / "data"
    for root in (twins.patched, twins.none):
        shutil.copytree(root, data / root.name)
    folder = page_of(tmp_path, data)
    assert folder.index["about"]["datasets"] == ["none", "odd"]
    assert {kind for kind, *_ in kinds(folder)} == {"image", "preview"}
    whole = page_of(tmp_path, twins.defended)
    assert whole.index["about"]["datasets"] == ["none", "odd"]
    assert whole.index["about"]["evaluations"] == ["odd + jpeg"]
    assert {kind for kind, *_ in kinds(whole)} == set(FOUND)
    one = page_of(tmp_path, twins.none)
    assert one.index["about"]["datasets"] == [""] and one.index["samples"][0]["compared"]["pictures"] == {}


def test_moved_datasets_still_belong_to_their_evaluation(twins: Any, tmp_path: Path) -> None:
    shutil.copytree(twins.none, tmp_path / "moved")
    page = page_of(tmp_path, tmp_path / "moved", evaluations=[twins.evaluation])
    assert ("prediction", "objects", "", "odd") in kinds(page)


def test_what_cannot_be_compared_is_one_line(twins: Any, tmp_path: Path, write_dataset: Any) -> None:
    out = tmp_path / "page.html"
    other = write_dataset("depth", 1)
    with pytest.raises(DatasetError, match="is no twin of"):
        write_view(twins.none, out, twins=[other])
    with pytest.raises(DatasetError, match="is an evaluation of other datasets"):
        write_view(other, out, evaluations=[twins.evaluation])
    with pytest.raises(DatasetError, match="holds no finished evaluation"):
        write_view(twins.none, out, evaluations=[twins.none])
    for damage in ("{}", '{"format": "gear-evaluation", "version": 1}', "[1]", "{"):
        broken = tmp_path / "broken"
        broken.mkdir(exist_ok=True)
        (broken / "results.json").write_text(damage)
        with pytest.raises(DatasetError, match=r"results\.json"):
            write_view(twins.none, out, evaluations=[broken])
    assert not out.exists()


def test_damaged_predictions_are_named_and_the_rest_is_shown(twins: Any, tmp_path: Path) -> None:
    copy = tmp_path / "evaluation"
    shutil.copytree(twins.defended, copy)
    picture = sorted(copy.glob("*-none-*/defended/000001_left.webp"))[0]
    picture.write_bytes(picture.read_bytes()[:-9])
    next(copy.glob("*-none-*/samples/000002.json")).write_text("{}")
    report = write_view(twins.none, tmp_path / "page.html", evaluations=[copy])
    assert [(number, text.partition(":")[2]) for number, text in report.problems] == [
        (1, " is not what was written"), (2, " is not the stored result of a sample"),
    ]  # fmt: skip
    page = Blocks(tmp_path / "page.html")
    there = [[picture is not None for picture in sample["pictures"]] for sample in page.index["samples"]]
    assert there == [[True] * 4, [True, True, False, False], [True, True, False, False], [True] * 4]


def test_a_link_in_an_evaluation_leads_nowhere(twins: Any, tmp_path: Path) -> None:
    copy = tmp_path / "evaluation"
    shutil.copytree(twins.evaluation, copy)
    found = json.loads((copy / "results.json").read_text())
    for row in found["rows"]:
        row["name"] = "../" + row["name"]
    (copy / "results.json").write_text(json.dumps(found))
    report = write_view(twins.none, tmp_path / "page.html", evaluations=[copy])
    assert len(report.problems) == 4 and "is not a path inside" in report.problems[0][1]


def test_an_evaluation_is_distinguished_from_a_dataset(twins: Any) -> None:
    assert is_evaluation(twins.evaluation) and not is_evaluation(twins.none)
    part = open_evaluation(twins.evaluation)[0]
    dataset = gear.open_dataset(twins.none)
    assert part.is_of(dataset) and not part.is_of(gear.open_dataset(twins.patched))
    assert part.prediction(dataset, dataset[1]) == dataset.task.as_prediction(dataset[1])
    assert part.defended(1) == {}


def test_predictions_are_drawn_in_the_colours_of_the_ground_truth(write_dataset: Any) -> None:
    for task, name in (("semseg", "labels"), ("depth", "depth")):
        dataset = gear.open_dataset(write_dataset(task, 1))
        sample = dataset[0]
        drawn = prediction_pictures(dataset.task, sample, dataset.task.as_prediction(sample))
        truth = dataset.task.preview(sample)[name]
        same = (drawn[name] == truth).all(axis=2).mean()
        assert same > 0.6 and picture_legends(dataset.task).keys() >= {name}  # instances and the sky differ


def test_detections_are_drawn_where_they_are(twins: Any) -> None:
    dataset = gear.open_dataset(twins.none)
    sample = dataset[0]
    (name, drawn), *_ = prediction_pictures(dataset.task, sample, dataset.task.as_prediction(sample)).items()
    assert name == "objects" and name in picture_legends(dataset.task)
    given = dataset.task.picture_objects(sample, dataset.task.as_prediction(sample))
    for one in given.detections:
        left, _, right, bottom = (round(side) for side in one.box_px)
        colour = np.array(label_colour(one.label, label_colours(dataset.task)))
        edge = drawn[min(bottom, drawn.shape[0]) - 1, max(left, 0) : right]
        assert (edge == colour).all(axis=1).mean() > 0.5
    nothing = prediction_pictures(dataset.task, sample, ())["objects"]
    assert (
        not (nothing == np.array(label_colour(given.detections[0].label, label_colours(dataset.task))))
        .all(axis=2)
        .any()
    )


def test_classes_have_the_colours_of_the_ground_truth_and_a_legend(write_dataset: Any) -> None:
    for task, (name, rgb) in {"detect2d": ("person", category_colour(1)), "stereo3d": ("Car", COLOURS["Car"])}.items():
        opened = gear.open_dataset(write_dataset(task, 1)).task
        assert label_colour(name, label_colours(opened)) == rgb
        legend = picture_legends(opened)["objects"]
        assert isinstance(legend, ColourNames) and (name, rgb) in legend.entries
        assert not {"ignored", "DontCare"} & {entry for entry, _ in legend.entries}
    assert label_colour("odd", {}) == label_colour("odd", {"person": (1, 2, 3)})


def test_labels_that_occur_twice_get_their_folders() -> None:
    assert unique(["a", "b"], ["x", "y"]) == ["a", "b"]
    assert unique(["a", "a"], ["x", "y"]) == ["a (x)", "a (y)"]
    assert unique(["a", "a"], ["x", "x"]) == ["a (x) 1", "a (x) 2"]


def test_the_streets_are_those_of_the_town() -> None:
    found = streets("town10")
    assert {kind for kind, _, _ in found} == {"lane", "sidewalk", "crosswalk"}
    assert all(width > 0 and len(line) >= 4 and len(line) % 2 == 0 for _, width, line in found)
    assert streets("no_such_town") == []
