"""KITTI depth: drives, annotated depth, and the cropped selection of the devkit."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from gear.formats.exports.kitti_depth import kitti_depth_tree
from gear.formats.exports.layout import ExportSplit, NoOptions
from gear.formats.png import decode_plain, decode_rgb, encode_labels, encode_rgb
from gear.plugins.tasks.depth import depth
from gear.testing.synthetic import synthetic_frame
from gear.testing.task_contract import INFO
from gear.values.rig import CameraMount, Rig
from tests.formats.exports.trees import exported, split_of, with_records, written


def test_kitti_depth_is_drives_and_the_cropped_selection(tmp_path: Path) -> None:
    val = written(tmp_path, depth, {"width_px": 1224, "height_px": 370}, (0,))
    files = exported("kitti-depth", [val], tmp_path)
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
    val = written(tmp_path, depth, {"width_px": 408, "height_px": 124})
    assert not any("selection" in name for name in exported("kitti-depth", [val], tmp_path))


def test_a_driving_split_is_a_drive_a_sequence(tmp_path: Path) -> None:
    val = written(tmp_path, depth, {"width_px": 408, "height_px": 124})
    a, b = (sidecar.record for sidecar in val.sidecars)
    driving = with_records(val, replace(a, sequence=4, frame=0), replace(b, sequence=4, frame=1))
    names = exported("kitti-depth", [driving], tmp_path)
    assert "val/2022_01_01_drive_0001_sync/proj_depth/groundtruth/image_02/0000000001.png" in names
    driving = with_records(val, replace(a, sequence=4, frame=1), replace(b, sequence=7, frame=0))
    names = exported("kitti-depth", [driving], tmp_path)
    assert "val/2022_01_01_drive_0001_sync/proj_depth/groundtruth/image_02/0000000001.png" in names
    assert "val/2022_01_01_drive_0002_sync/proj_depth/groundtruth/image_02/0000000000.png" in names


def test_single_pictures_are_one_drive_and_train_has_its_own_pool(tmp_path: Path) -> None:
    val = written(tmp_path, depth, {"width_px": 408, "height_px": 124})
    a, b = (sidecar.record for sidecar in val.sidecars)
    for folder in ("leftImg8bit", "gtFine"):
        (tmp_path / folder / "train").mkdir()
        for path in (tmp_path / folder / "val").glob("rgb_*.png"):
            (tmp_path / folder / "train" / path.name).write_bytes(path.read_bytes())
    train = replace(val, info=replace(INFO, split="train"))
    single = with_records(val, replace(a, sequence=0), replace(b, sequence=1))
    names = [name for name in exported("kitti-depth", [single, train], tmp_path) if "groundtruth" in name]
    assert names == [
        f"{pool}/2022_01_01_drive_{drive}_sync/proj_depth/groundtruth/image_02/{frame:010d}.png"
        for pool, drive in (("val", "0001"), ("train", "0002"))
        for frame in (0, 1)
    ]


def split_at(width_px: int, height_px: int, name: str = "val", frame: int = 0) -> ExportSplit:
    """One record of a camera of that size; no picture is rendered at that size."""
    _, record = synthetic_frame(Rig(cameras=(CameraMount(name="left", width_px=16, height_px=16),)), [], index=3)
    camera = replace(record.cameras[0], width_px=width_px, height_px=height_px)
    record = replace(record, cameras=(camera,), frame=frame)
    return split_of(replace(INFO, split=name, created="2024-05-06"), "depth", record)


@pytest.mark.parametrize(
    ("width_px", "height_px", "left", "top"), [(1216, 352, 0, 0), (1217, 353, 0, 1), (1220, 360, 2, 8)]
)
def test_the_selection_is_cut_from_the_middle_of_the_bottom(width_px: int, height_px: int, left: int, top: int) -> None:
    """Every pixel of the crop is at its column less `left` and its row less `top`, and so is the principal point."""
    numbers = np.arange(width_px * height_px, dtype=np.uint32).reshape(height_px, width_px)
    picture = np.stack([numbers & 255, numbers >> 8 & 255, numbers >> 16], axis=-1).astype(np.uint8)
    truth = (numbers % 60000).astype(np.uint16)
    stored = {
        "leftImg8bit/val/rgb_0003.png": encode_rgb(picture),
        "gtFine/val/rgb_0003.png": encode_labels(truth),
    }
    split = split_at(width_px, height_px)
    files = dict(kitti_depth_tree([split], stored.__getitem__, NoOptions()))
    stem, middle = "val_selection_cropped", "2024_05_06_drive_0001_sync_{}_0000000003_image_02"
    image = files[f"{stem}/image/{middle.format('image')}.png"]
    depths = files[f"{stem}/groundtruth_depth/{middle.format('groundtruth_depth')}.png"]
    np.testing.assert_array_equal(decode_rgb(image), picture[top : top + 352, left : left + 1216])
    np.testing.assert_array_equal(decode_plain(depths), truth[top : top + 352, left : left + 1216])
    pinhole = split.sidecars[0].record.cameras[0].intrinsics
    matrix = [float(v) for v in files[f"{stem}/intrinsics/{middle.format('image')}.txt"].split()]
    fx, fy = pinhole.fx_px, pinhole.fy_px
    assert matrix == pytest.approx([fx, 0, pinhole.cx_px - left, 0, fy, pinhole.cy_px - top, 0, 0, 1], abs=1e-6)
    assert len(files) == 6


@pytest.mark.parametrize(("width_px", "height_px"), [(1215, 400), (1300, 351)])
def test_a_picture_that_is_too_small_in_one_direction_is_not_cropped(width_px: int, height_px: int) -> None:
    files = dict(kitti_depth_tree([split_at(width_px, height_px)], str.encode, NoOptions()))
    assert not any("selection" in name for name in files) and len(files) == 3


def test_training_pictures_are_in_no_selection() -> None:
    """Drives are numbered through all splits, and a driving split counts frames instead of indices."""
    train, test = split_at(1300, 400, "train", frame=7), split_at(100, 50, "test")
    files = dict(kitti_depth_tree([train, test], str.encode, NoOptions()))
    image = "2024_05_06/2024_05_06_drive_{}_sync/image_02/data/{}.png"
    truth = "{}/2024_05_06_drive_{}_sync/proj_depth/groundtruth/image_02/{}.png"
    paths = [
        (image.format("0001", "0000000007"), truth.format("train", "0001", "0000000007")),
        (image.format("0002", "0000000003"), truth.format("val", "0002", "0000000003")),
    ]
    assert files == {
        paths[0][0]: b"leftImg8bit/train/rgb_0003.png",
        paths[0][1]: b"gtFine/train/rgb_0003.png",
        "filenames/train.txt": f"/{paths[0][0]} /{paths[0][1]}\n".encode(),
        paths[1][0]: b"leftImg8bit/test/rgb_0003.png",
        paths[1][1]: b"gtFine/test/rgb_0003.png",
        "filenames/test.txt": f"/{paths[1][0]} /{paths[1][1]}\n".encode(),
    }
