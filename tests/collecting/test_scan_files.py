"""`scans: true` of a collection: laser scans beside the samples, and KITTI's tree with them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import gear
from gear.collecting.run import CollectReport
from gear.formats.kitti_object import SCAN, parse_calibration, parse_points
from gear.verbs.export import export
from tests.dataset.splits import tree
from tests.verbs.conftest import Copy

Collect = Callable[..., CollectReport]
SCANS = ["scans=true"]


@pytest.mark.slow
def test_scans_agree_with_depth_and_reach_kittis_tree(tmp_path: Path, collect_small: Collect, copy_small: Copy) -> None:
    collect_small("depth", tmp_path / "depth", settings=SCANS)
    collect_small("stereo3d", tmp_path / "stereo", settings=SCANS, split="test")
    copy_small("depth", tmp_path / "plain")
    plain = {name: data for name, data in tree(tmp_path / "plain").items() if name.startswith(("gtFine", "left"))}
    assert plain.items() <= tree(tmp_path / "depth").items(), "pictures and labels do not depend on scans"
    opened = gear.open_dataset(tmp_path / "depth")
    assert opened.verify() == []
    for index, sample in enumerate(opened):
        points = parse_points((tmp_path / "depth" / opened.sidecar(index).auxiliary[SCAN].path).read_bytes())
        assert len(points) > 20_000 and np.linalg.norm(points[:, :3], axis=1).min() >= 0.9
        camera = sample.record.camera("left")
        in_camera = points[:, :3] @ np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]]).T
        in_camera = in_camera[in_camera[:, 2] > 0.5]
        pixels = np.rint(camera.intrinsics.project(in_camera)).astype(int)
        inside = (pixels >= 0).all(axis=1) & (pixels < (camera.width_px, camera.height_px)).all(axis=1)
        depth_m = sample.depth_m[pixels[inside, 1], pixels[inside, 0]]
        error = np.abs(depth_m - in_camera[inside, 2]) / in_camera[inside, 2]
        assert inside.sum() > 3000
        assert np.nanmedian(error) < 0.01 and (error < 0.05).mean() > 0.9, "but for edges, which pixels of 1/160 blur"
    export(tmp_path / "stereo", layout="kitti", out=tmp_path / "kitti")
    pool = tmp_path / "kitti/testing"
    assert sorted(path.name for path in pool.iterdir()) == ["calib", "image_2", "image_3", "label_2", "velodyne"]
    assert (tmp_path / "kitti/ImageSets/test.txt").read_text() == "000000\n000001\n"
    points = np.fromfile(pool / "velodyne/000000.bin", dtype=np.float32).reshape(-1, 4)
    calibration = parse_calibration((pool / "calib/000000.txt").read_text())
    assert np.array_equal(calibration["Tr_velo_to_cam"][:, :3] @ [1, 0, 0], [0, 0, 1])
    assert np.median(points[points[:, 2] < -1.4][:, 2]) == pytest.approx(-1.65, abs=0.15), "the street lies below"
