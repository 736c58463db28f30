"""Driving sequences of a dataset, and their pictures and calibration."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from gear.formats.exports.layout import NoOptions
from gear.formats.exports.registry import find_layout
from gear.formats.exports.sequences import calibration_of, driving_splits, pictures_of, records_of, sequences_of
from gear.values.errors import DatasetError
from gear.values.scene import SceneRecord
from gear.values.serial import Json
from tests.formats.driving.drives import circle, split_with
from tests.formats.exports.test_kitti_flow import read, with_flow


def test_splits_of_single_pictures_are_left_out() -> None:
    drive = split_with((*circle(3), *circle(3, sequence=1, start=3)), "depth")
    single = split_with((*circle(1), *circle(1, sequence=1, start=1)), "depth", split="train")
    assert driving_splits([single, drive], "kitti-raw") == [drive]
    with pytest.raises(DatasetError, match=r"split train: has single pictures only.*'kitti-raw'.*--split video"):
        driving_splits([single], "kitti-raw")


def test_sequences_stay_together() -> None:
    split = split_with((*circle(3), *circle(2, sequence=1, start=3)), "depth")
    found = [[record.index for record in records_of(sequence)] for sequence in sequences_of(split)]
    assert found == [[0, 1, 2], [3, 4]]


def retimed(records: tuple[SceneRecord, ...], *times_s: float) -> tuple[SceneRecord, ...]:
    return tuple(replace(record, time_s=time_s) for record, time_s in zip(records, times_s, strict=True))


@pytest.mark.parametrize(
    ("records", "problem"),
    [
        ((*circle(2), *circle(1, sequence=1, start=2)), "sequence 1 has one frame only"),
        (retimed(circle(2), 1.0, 1.0), "sequence 0 has frames whose times do not increase"),
        (retimed(circle(3), 0.0, 0.2, 0.1), "times do not increase"),
        (retimed(circle(2), 0.0, math.nan), "times do not increase"),
        ((circle(3)[0], circle(3)[2]), "do not count from 0 to 1"),
        ((circle(2)[0], circle(2)[0]), "do not count from 0 to 1"),
    ],
)
def test_short_and_standing_sequences_are_refused(records: tuple[SceneRecord, ...], problem: str) -> None:
    with pytest.raises(DatasetError, match=f"split video: .*{problem}"):
        list(sequences_of(split_with(records, "depth")))


def read_any(path: str) -> bytes:
    return b"" if "label_2" in path else read(path)


LAYOUTS = {
    "mot": "detect2d", "kitti-tracking": "stereo3d", "kitti-raw": "depth", "kitti-flow": "depth",
    "kitti-odometry": "depth",
}  # fmt: skip


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize(
    "records", [(*circle(2), *circle(1, sequence=1, start=2)), retimed(circle(2), 0.0, 0.0)], ids=["short", "standing"]
)
def test_each_layout_refuses_them_in_one_line(layout: str, records: tuple[SceneRecord, ...]) -> None:
    split = with_flow(split_with(records, LAYOUTS[layout]))
    with pytest.raises(DatasetError) as caught:
        dict(find_layout(layout).tree([split], read_any, find_layout(layout).options()))
    assert "sequence" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("facts", [{}, [], None, {"objects": 1}, {"objects": [{}]}, {"objects": ["a"]}, "a"])
@pytest.mark.parametrize("layout", ["mot", "kitti-tracking"])
def test_impossible_facts_are_one_line(layout: str, facts: Json) -> None:
    split = split_with(circle(2), LAYOUTS[layout], facts=[facts] * 2)
    with pytest.raises(DatasetError, match=r"split video: holds impossible values|its sidecar") as caught:
        dict(find_layout(layout).tree([split], lambda path: b"", find_layout(layout).options()))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", [b"\xff\xfe", b"Car 1 2\n", b"no picture\x1b[2J"])
@pytest.mark.parametrize("layout", ["kitti-tracking", "kitti-flow"])
def test_damaged_files_are_one_line(layout: str, content: bytes) -> None:
    split = with_flow(split_with(circle(2), LAYOUTS[layout], facts=[{"objects": [{"object_id": 1}]}] * 2))
    with pytest.raises(DatasetError, match="holds impossible values") as caught:
        dict(find_layout(layout).tree([split], lambda path: content, find_layout(layout).options()))
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("created", ["yesterday", "9999-12-31", ""])
def test_a_date_that_is_none_is_one_line(created: str) -> None:
    splits = [split_with(circle(2), "depth"), split_with(circle(2), "depth", split="late")]
    dated = [replace(split, info=replace(split.info, created=created)) for split in splits]
    with pytest.raises(DatasetError, match="split video, late: holds impossible values"):
        dict(find_layout("kitti-raw").tree(dated, str.encode, NoOptions()))


def test_errors_of_the_caller_pass() -> None:
    """Only errors of the layout are about the dataset."""
    tree = find_layout("kitti-raw").tree([split_with(circle(2), "depth")], str.encode, NoOptions())
    with pytest.raises(KeyError):
        for _ in tree:
            raise KeyError("mine")


def test_pictures_lie_where_the_tasks_write_them() -> None:
    record = circle(2, start=7)[1]
    left = {task: pictures_of(split_with((record,), task), record)["left"] for task in ("detect2d", "depth", "semseg")}
    assert left["detect2d"] == "images/video/rgb_0008.png" and left["depth"] == "leftImg8bit/video/rgb_0008.png"
    assert left["semseg"].startswith("leftImg8bit/video/") and left["semseg"].endswith("000000_000001_leftImg8bit.png")
    stereo = pictures_of(split_with((record,), "stereo3d"), record)
    assert stereo == {"left": "video/image_2/000008.png", "right": "video/image_3/000008.png"}


def test_the_baseline_is_that_of_the_record() -> None:
    assert calibration_of(circle(1, is_stereo=True)[0]).baseline_m == pytest.approx(0.54)
    assert calibration_of(circle(1)[0]).baseline_m == 0.0
