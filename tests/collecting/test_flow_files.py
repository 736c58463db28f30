"""`flow: true` of a collection: optical flow beside the samples, and KITTI's tree with it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest

import gear
from gear.collecting.flow_files import flow_files
from gear.collecting.run import CollectReport
from gear.formats.driving.flow_png import decode_flow
from gear.formats.png import decode_plain
from gear.groundtruth.optical_flow import Flow
from gear.values.errors import ConfigError
from gear.verbs.export import export
from tests.dataset.splits import tree
from tests.verbs.conftest import Copy

Collect = Callable[..., CollectReport]
DRIVE = Path(__file__).parents[1] / "formats/driving/drive.yml"
VIDEO = {"split": "video", "samples": None, "scene": "no_billboard"}


def test_a_flow_is_three_files() -> None:
    flow_px = np.array([[[1.5, 0.0], [np.nan, np.nan]]], np.float32)
    actors = np.array([[0, 300]], np.uint16)
    flow = Flow(flow_px=flow_px, is_visible=np.array([[True, False]]), actor_id=actors)
    files = flow_files(flow, "left", "video", 12)
    assert {key: file.path for key, (file, _) in files.items()} == {
        "flow/left": "gear/video/flow/000012_left.png",
        "flow/left/visible": "gear/video/flow/000012_left_visible.png",
        "flow/left/actors": "gear/video/flow/000012_left_actors.png",
    }
    assert files["flow/left"][0].facts == {"known_px": 1, "visible_px": 1}
    assert np.array_equal(decode_flow(files["flow/left"][1]), flow_px, equal_nan=True)
    assert decode_plain(files["flow/left/visible"][1]).tolist() == [[255, 0]]
    assert np.array_equal(decode_plain(files["flow/left/actors"][1]), actors)


def test_single_pictures_have_no_flow(tmp_path: Path, collect_small: Collect) -> None:
    with pytest.raises(ConfigError, match=r"split 'debug' has single pictures.*use --split video"):
        collect_small("depth", tmp_path / "x", settings=["flow=true"])
    assert not (tmp_path / "x").exists()


@pytest.mark.slow
def test_flow_leads_from_picture_to_picture(tmp_path: Path, collect_small: Collect, copy_small: Copy) -> None:
    drive = [f"simulation={DRIVE}"]
    collect_small("depth", tmp_path / "a", settings=[*drive, "flow=true"], **VIDEO)
    copy_small("depth", tmp_path / "plain", settings=drive, **VIDEO)
    plain = {name: data for name, data in tree(tmp_path / "plain").items() if name.startswith(("gtFine", "left"))}
    assert plain.items() <= tree(tmp_path / "a").items(), "pictures and labels do not depend on flow"
    opened = gear.open_dataset(tmp_path / "a")
    assert opened.verify() == []
    samples = list(opened)
    assert len({tuple((actor.id, actor.asset) for actor in sample.record.actors) for sample in samples}) == 1
    assert [bool(opened.sidecar(index).auxiliary) for index in range(4)] == [True, True, True, False]
    for index, (now, after) in enumerate(pairwise(samples)):
        files = opened.sidecar(index).auxiliary
        flow_px = decode_flow((tmp_path / "a" / files["flow/left"].path).read_bytes())
        is_visible = decode_plain((tmp_path / "a" / files["flow/left/visible"].path).read_bytes()) > 0
        known = np.isfinite(flow_px).all(axis=-1)
        assert known.mean() > 0.99 and 0.6 < is_visible.mean() < 1.0
        row, column = np.indices(known.shape, np.float32)
        x, y = column + flow_px[..., 0], row + flow_px[..., 1]
        is_surface = is_visible & np.isfinite(now.depth_m)
        cameras = [sample.record.camera("left") for sample in (now, after)]
        points_m = cameras[0].intrinsics.unproject(np.stack([column, row], axis=-1), now.depth_m)
        world_m = cameras[0].world_from_camera_transform.apply(points_m)
        moved_m = cameras[1].world_from_camera_transform.inverse().apply(world_m)
        error_px = np.abs(cameras[1].intrinsics.project(moved_m) - np.stack([x, y], axis=-1)).max(axis=-1)[is_surface]
        assert (error_px <= 1 / 64).mean() > 0.97, "all but the pixels of road users"
        nearness = np.nan_to_num(1 / after.depth_m)  # linear in the picture on every plane
        pulled = cv2.remap(nearness, x, y, cv2.INTER_LINEAR)
        assert np.median(np.abs(pulled * moved_m[..., 2] - 1)[is_surface]) < 1e-3
        assert np.median(np.abs(nearness * moved_m[..., 2] - 1)[is_surface]) > 0.01, "the car drives"
    export(tmp_path / "a", layout="kitti-flow", out=tmp_path / "exported")
    pool = tmp_path / "exported/training"
    assert sorted(path.name for path in pool.glob("flow_noc/*")) == [f"{pair:06d}_10.png" for pair in range(3)]
    units = cv2.imread(str(pool / "flow_occ/000001_10.png"), cv2.IMREAD_UNCHANGED)[..., ::-1].astype(np.float32)
    stored = decode_flow((tmp_path / "a" / opened.sidecar(1).auxiliary["flow/left"].path).read_bytes())
    is_valid = units[..., 2] > 0
    assert np.array_equal(is_valid, np.isfinite(stored).all(axis=-1))
    assert np.array_equal((units[..., :2][is_valid] - 2**15) / 64, stored[is_valid]), "by the devkit's formula"
    for number, index in ((10, 1), (11, 2)):
        picture = cv2.imread(str(pool / f"image_2/000001_{number}.png"))[..., ::-1]
        assert np.array_equal(picture, samples[index].images["left"])
