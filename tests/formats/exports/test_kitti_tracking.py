"""KITTI tracking: the labels of the object benchmark, with the ids of the sidecars."""

from __future__ import annotations

from dataclasses import replace

import pytest

from gear.contracts.tasks import Auxiliary
from gear.formats.exports.kitti_tracking import kitti_tracking_tree
from gear.formats.exports.layout import NoOptions
from gear.formats.kitti_object import SCAN, dont_care, format_labels
from gear.values.errors import DatasetError
from tests.formats.driving.drives import circle, split_with
from tests.formats.driving.test_tracks import CAR

LABELS = format_labels([CAR, dont_care((0.0, 0.0, 3.0, 4.0)), replace(CAR, type="Pedestrian")])
FACTS = {"objects": [{"object_id": 4}, {"object_id": 9}, {"object_id": 5}]}


def read(path: str) -> bytes:
    return LABELS if "label_2" in path else path.encode()


def test_tracks_keep_their_ids_through_a_sequence() -> None:
    records = (*circle(3, is_stereo=True), *circle(2, sequence=1, start=3, is_stereo=True))
    splits = [
        split_with(records, "stereo3d", facts=[FACTS] * 5),
        split_with(circle(2), "stereo3d", split="test_night", facts=[FACTS] * 2),
    ]
    files = dict(kitti_tracking_tree(splits, read, NoOptions()))
    rows = [line.split() for line in files["training/label_02/0001.txt"].decode().splitlines()]
    assert [row[:3] for row in rows] == [
        [str(frame), *rest] for frame in range(2) for rest in (("4", "Car"), ("-1", "DontCare"), ("5", "Pedestrian"))
    ]
    assert files["training/image_03/0001/000001.png"] == b"video/image_3/000004.png"
    assert files["training/evaluate_tracking.seqmap.training"].split() == (
        b"0000 empty 000000 000003 0001 empty 000000 000002".split()
    )
    assert files["testing/evaluate_tracking.seqmap.test"] == b"0000 empty 000000 000002\n"
    assert files["training/oxts/0000.txt"].count(b"\n") == 3
    assert len(files) == 2 * 5 + 2 * 3 + 1 + 2 * 2 + 3 + 1


def test_scans_are_there_where_the_dataset_has_them() -> None:
    split = split_with(circle(2), "stereo3d", facts=[FACTS] * 2)
    scanned = tuple(
        replace(sidecar, auxiliary={SCAN: Auxiliary(path=f"scan{number}", facts=None)})
        for number, sidecar in enumerate(split.sidecars)
    )
    files = dict(kitti_tracking_tree([replace(split, sidecars=scanned)], read, NoOptions()))
    assert files["training/velodyne/0000/000001.bin"] == b"scan1"


def test_labels_that_do_not_fit_their_sidecar_are_refused() -> None:
    split = split_with(circle(2), "stereo3d", facts=[{"objects": []}] * 2)
    with pytest.raises(DatasetError, match="has 3 lines, its sidecar 0 objects"):
        dict(kitti_tracking_tree([split], read, NoOptions()))
