from pathlib import Path
from typing import Any, ClassVar

import cv2
import numpy as np
import pytest

from gear.plugins.tasks.depth import DepthConfig, DepthTask, depth
from gear.testing.synthetic import synthetic_frame
from gear.testing.task_contract import INFO, TaskContract
from gear.values.errors import FieldError


class TestDepth(TaskContract):
    spec = depth
    options: ClassVar = {"width_px": 408, "height_px": 124}
    headline = "rmse_m"
    perfect = 0.0
    undirected = frozenset({"nearest_obstacle.bias_rel", "nearest_obstacle.has_obstacle"})

    def spoil(self, prediction: Any) -> Any:
        return prediction * np.float32(1.1)

    def test_both_files_say_the_same_metres(self, tmp_path: Path) -> None:
        self.write(tmp_path, [0])
        frame, _ = self.frame(0)
        truth = frame.views["left"].depth_m
        units = cv2.imread(str(tmp_path / "gtFine/val/rgb_0000.png"), cv2.IMREAD_UNCHANGED)
        metres = cv2.imread(str(tmp_path / "gtFine/val/rgb_0000.tiff"), cv2.IMREAD_UNCHANGED)
        assert units.dtype == np.uint16 and units.ndim == 2
        assert metres.dtype == np.float32
        known = np.isfinite(truth)
        np.testing.assert_array_equal(metres[known], truth[known])
        assert (metres[~known] == 0).all() and (units[~known] == 0).all()
        near = known & (truth < 255)
        np.testing.assert_allclose(units[near] / 256, truth[near], atol=0.5 / 256)
        assert (units[known & (truth > 256)] == 0).all()

    def test_lists_name_files_that_exist(self, tmp_path: Path) -> None:
        self.write(tmp_path)
        for name, suffix in (("val_list.txt", ".tiff"), ("val_list_kitti.txt", ".png")):
            text = (tmp_path / "filenames" / name).read_text()
            assert not text.endswith("\n")
            lines = text.split("\n")
            assert len(lines) == 2
            for line in lines:
                image, truth = line.split(" ")
                # Loaders append with +, so the paths must start with a slash.
                assert Path(str(tmp_path) + image).is_file() and Path(str(tmp_path) + truth).is_file()
                assert truth.endswith(suffix)


def test_the_devkit_sees_a_prediction_beyond_256_m() -> None:
    """It takes 0 for no prediction and fills it in from the neighbours, as if it were right."""
    task = DepthTask(DepthConfig(width_px=64, height_px=32))
    frame, record = synthetic_frame(task.rig())
    said = np.full((32, 64), 300.0, dtype=np.float32)
    said[0] = 0.001
    files = task.encode_prediction(task.ground_truth(frame, record), said, INFO).files
    units = cv2.imdecode(np.frombuffer(files["depth/rgb_0000.png"], np.uint8), cv2.IMREAD_UNCHANGED)
    assert (units[1:] == 65535).all() and (units[0] == 1).all()


def test_depth_ends_at_the_range() -> None:
    task = DepthTask(DepthConfig(width_px=256, height_px=128, max_depth_m=30.0))
    frame, record = synthetic_frame(task.rig())
    sample = task.ground_truth(frame, record)
    truth = frame.views["left"].depth_m
    assert np.nanmax(sample.depth_m) <= 30.0 < np.nanmax(truth)
    np.testing.assert_array_equal(np.isfinite(sample.depth_m), truth <= 30.0)


def test_a_bad_range_is_refused() -> None:
    with pytest.raises(FieldError, match="max_depth_m"):
        DepthConfig(max_depth_m=0.0)
