from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gear.formats.exports import SplitRecords, layouts
from gear.formats.kitti_object import parse_labels
from gear.plugins.tasks.depth import depth
from gear.plugins.tasks.stereo3d import stereo3d
from gear.testing.task_contract import INFO, TaskContract


def collected(root: Path, spec_: Any, options_: dict[str, Any], indexes: tuple[int, ...] = (0, 1)) -> SplitRecords:
    class Writer(TaskContract):
        spec = spec_
        options = options_

    return SplitRecords(info=INFO, records=tuple(sidecar.record for sidecar in Writer().write(root, indexes)))


def export(name: str, splits: list[SplitRecords], root: Path) -> dict[str, bytes]:
    files: dict[str, bytes] = {}
    for path, data in layouts()[name].tree(splits, lambda relative: (root / relative).read_bytes()):
        assert path not in files, "no file is written twice"
        files[path] = data
    return files


def test_kitti_is_one_pool_with_lists(tmp_path: Path) -> None:
    val = collected(tmp_path, stereo3d, {"width_px": 306, "height_px": 92})
    for folder in ("image_2", "image_3", "calib", "label_2"):
        (tmp_path / "train" / folder).mkdir(parents=True)
        for path in (tmp_path / "val" / folder).glob("000000.*"):
            (tmp_path / "train" / folder / path.name).write_bytes(path.read_bytes())
    train = replace(val, info=replace(INFO, split="train"), records=val.records[:1])
    files = export("kitti", [train, val], tmp_path)
    assert files["ImageSets/train.txt"] == b"000000\n"
    assert files["ImageSets/val.txt"] == b"000001\n000002\n"
    assert files["ImageSets/trainval.txt"] == b"000000\n000001\n000002\n"
    assert files["training/image_3/000002.png"] == (tmp_path / "val/image_3/000001.png").read_bytes()
    assert len(parse_labels(files["training/label_2/000001.txt"].decode())) > 3
    assert len(files) == 3 * 4 + 3


def test_kitti_depth_is_drives_and_the_cropped_selection(tmp_path: Path) -> None:
    val = collected(tmp_path, depth, {"width_px": 1224, "height_px": 370}, (0,))
    files = export("kitti-depth", [val], tmp_path)
    drive = "2022_01_01_drive_0001_sync"
    truth = f"val/{drive}/proj_depth/groundtruth/image_02/0000000000.png"
    image = f"2022_01_01/{drive}/image_02/data/0000000000.png"
    assert files[truth] == (tmp_path / "gtFine/val/rgb_0000.png").read_bytes()
    assert files[image] == (tmp_path / "leftImg8bit/val/rgb_0000.png").read_bytes()
    assert files["filenames/val.txt"] == f"/{image} /{truth}\n".encode()
    selection = "val_selection_cropped"
    name = f"{drive}_groundtruth_depth_0000000000_image_02.png"
    cropped = cv2.imdecode(
        np.frombuffer(files[f"{selection}/groundtruth_depth/{name}"], np.uint8), cv2.IMREAD_UNCHANGED
    )
    whole = cv2.imread(str(tmp_path / "gtFine/val/rgb_0000.png"), cv2.IMREAD_UNCHANGED)
    assert cropped.shape == (352, 1216) and cropped.dtype == np.uint16
    np.testing.assert_array_equal(cropped, whole[18:, 4:1220])
    intrinsics = files[f"{selection}/intrinsics/{drive}_image_0000000000_image_02.txt"].split()
    assert [float(v) for v in intrinsics] == pytest.approx([612, 0, 607.5, 0, 612, 166.5, 0, 0, 1])
    picture = cv2.imdecode(
        np.frombuffer(files[f"{selection}/image/{drive}_image_0000000000_image_02.png"], np.uint8), cv2.IMREAD_COLOR
    )
    original = cv2.imread(str(tmp_path / "leftImg8bit/val/rgb_0000.png"))
    np.testing.assert_array_equal(picture, original[18:, 4:1220])


def test_small_pictures_are_not_cropped(tmp_path: Path) -> None:
    val = collected(tmp_path, depth, {"width_px": 408, "height_px": 124})
    assert not any("selection" in name for name in export("kitti-depth", [val], tmp_path))


def test_a_driving_split_is_a_drive_a_sequence(tmp_path: Path) -> None:
    val = collected(tmp_path, depth, {"width_px": 408, "height_px": 124})
    a, b = val.records
    driving = replace(val, records=(replace(a, sequence=4, frame=0), replace(b, sequence=4, frame=1)))
    names = export("kitti-depth", [driving], tmp_path)
    assert "val/2022_01_01_drive_0001_sync/proj_depth/groundtruth/image_02/0000000001.png" in names
    driving = replace(val, records=(replace(a, sequence=4, frame=1), replace(b, sequence=7, frame=0)))
    names = export("kitti-depth", [driving], tmp_path)
    assert "val/2022_01_01_drive_0001_sync/proj_depth/groundtruth/image_02/0000000001.png" in names
    assert "val/2022_01_01_drive_0002_sync/proj_depth/groundtruth/image_02/0000000000.png" in names


def test_single_pictures_are_one_drive_whatever_their_sequence_and_train_has_a_pool_of_its_own(tmp_path: Path) -> None:
    val = collected(tmp_path, depth, {"width_px": 408, "height_px": 124})
    a, b = val.records
    for folder in ("leftImg8bit", "gtFine"):
        (tmp_path / folder / "train").mkdir()
        for path in (tmp_path / folder / "val").glob("rgb_*.png"):
            (tmp_path / folder / "train" / path.name).write_bytes(path.read_bytes())
    train = replace(val, info=replace(INFO, split="train"))
    single = replace(val, records=(replace(a, sequence=0), replace(b, sequence=1)))
    names = [name for name in export("kitti-depth", [single, train], tmp_path) if "groundtruth" in name]
    assert names == [
        f"{pool}/2022_01_01_drive_{drive}_sync/proj_depth/groundtruth/image_02/{frame:010d}.png"
        for pool, drive in (("val", "0001"), ("train", "0002"))
        for frame in (0, 1)
    ]
