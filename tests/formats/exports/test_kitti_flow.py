"""KITTI flow: neighbouring frames as pairs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gear.contracts.tasks import Auxiliary
from gear.formats.driving.flow_png import decode_flow, encode_flow
from gear.formats.exports.kitti_flow import kitti_flow_tree, object_map
from gear.formats.exports.layout import ExportSplit, NoOptions
from gear.formats.png import decode_plain, encode_labels
from gear.values.errors import DatasetError
from tests.formats.driving.drives import circle, split_with

WHOLE = encode_flow(np.full((2, 3, 2), 1.5, np.float32))
SHOWN = np.array([[255, 0, 0], [255, 255, 0]], np.uint8)
ACTORS = np.array([[0, 7, 7], [300, 0, 2]], np.uint16)


def read(path: str) -> bytes:
    given = {"whole": WHOLE, "shown": encode_labels(SHOWN), "actors": encode_labels(ACTORS)}
    return given.get(path, path.encode())


def with_flow(split: ExportSplit) -> ExportSplit:
    places = {"flow/left": "whole", "flow/left/visible": "shown", "flow/left/actors": "actors"}
    files = {key: Auxiliary(path=path, facts=None) for key, path in places.items()}
    return replace(split, sidecars=tuple(replace(sidecar, auxiliary=files) for sidecar in split.sidecars))


def test_neighbouring_frames_are_pairs() -> None:
    records = (*circle(3, is_stereo=True), *circle(2, sequence=1, start=3, is_stereo=True))
    splits = [
        with_flow(split_with(records, "stereo3d")), with_flow(split_with(circle(2), "stereo3d", split="test_drive"))
    ]  # fmt: skip
    files = dict(kitti_flow_tree(splits, read, NoOptions()))
    seconds = {path: data.decode() for path, data in files.items() if path.endswith("_11.png") and "image_2" in path}
    assert seconds == {
        "training/image_2/000000_11.png": "video/image_2/000001.png",
        "training/image_2/000001_11.png": "video/image_2/000002.png",
        "training/image_2/000002_11.png": "video/image_2/000004.png",
        "testing/image_2/000000_11.png": "test_drive/image_2/000001.png",
    }
    assert files["training/image_3/000002_10.png"] == b"video/image_3/000003.png"
    assert files["training/flow_occ/000002_10.png"] == WHOLE
    shown = decode_flow(files["training/flow_noc/000002_10.png"])
    assert np.array_equal(np.isfinite(shown).all(axis=-1), SHOWN > 0) and (shown[SHOWN > 0] == 1.5).all()
    objects = decode_plain(files["training/obj_map/000002_10.png"])
    assert objects.tolist() == [[0, 2, 2], [3, 0, 1]] and objects.dtype == np.uint8
    assert len(files) == 4 * 8


def test_more_road_users_than_numbers_share_the_last_one() -> None:
    ids = np.arange(300, dtype=np.uint16)[None]
    assert object_map(ids)[0, [0, 1, 254, 255, 299]].tolist() == [0, 1, 254, 255, 255]


def test_a_dataset_without_flow_is_refused() -> None:
    with pytest.raises(DatasetError, match="split video: has no optical flow; collect it with --set flow=true"):
        dict(kitti_flow_tree([split_with(circle(2), "depth")], read, NoOptions()))
