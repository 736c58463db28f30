import math
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import cv2
import numpy as np
import pytest

from gear.formats.kitti_object import parse_calibration, parse_labels, read_baseline_m
from gear.plugins.tasks.stereo3d import Stereo3dConfig, Stereo3dTask, stereo3d
from gear.testing.synthetic import synthetic_frame
from gear.testing.task_contract import TaskContract
from gear.testing.things import CAR, CYCLIST, VAN, Thing
from gear.values.errors import FieldError


class TestStereo3d(TaskContract):
    spec = stereo3d
    options: ClassVar = {"width_px": 612, "height_px": 185}
    headline = "ap_3d_moderate"
    repeats = 60

    def spoil(self, prediction: Any) -> Any:
        return tuple(replace(f, location_m=(f.location_m[0] + 0.7, *f.location_m[1:])) for f in prediction)

    def test_loaders_find_every_file(self, tmp_path: Path) -> None:
        self.write(tmp_path)
        text = (tmp_path / "splits/val.txt").read_text()
        assert text == "000000\n000001"
        assert (tmp_path / "ImageSets/val.txt").read_text() == "000000\n000001\n"
        for name in text.split("\n"):
            for folder, suffix in (("image_2", "png"), ("image_3", "png"), ("calib", "txt"), ("label_2", "txt")):
                assert (tmp_path / "val" / folder / f"{name}.{suffix}").is_file()

    def test_disparity_is_focal_length_times_baseline_over_depth(self, tmp_path: Path) -> None:
        self.write(tmp_path, [0])
        left = cv2.imread(str(tmp_path / "val/image_2/000000.png"))
        right = cv2.imread(str(tmp_path / "val/image_3/000000.png"))
        matrices = parse_calibration((tmp_path / "val/calib/000000.txt").read_text())
        frame, _ = self.frame(0)
        depth_m, other_m = frame.views["left"].depth_m, frame.views["right"].depth_m
        focal_px, baseline_m = matrices["P2"][0, 0], read_baseline_m(matrices)
        assert baseline_m == pytest.approx(0.54)
        rows, columns = np.nonzero(np.isfinite(depth_m))
        disparity = focal_px * baseline_m / depth_m[rows, columns]
        there = columns - disparity
        inside = there >= 0
        rows, columns, there = rows[inside], columns[inside], np.round(there[inside]).astype(int)
        # Where the right camera sees the same point, it sees it at the same depth and in the same paint.
        same = np.abs(other_m[rows, there] - depth_m[rows, columns]) < 0.02 * depth_m[rows, columns]
        assert same.mean() > 0.85
        agree = (left[rows[same], columns[same]] == right[rows[same], there[same]]).all(axis=1).mean()
        swapped = (right[rows[same], columns[same]] == left[rows[same], there[same]]).all(axis=1).mean()
        assert agree > 0.8 > swapped + 0.1

    def test_labels_fit_the_id_buffer(self, tmp_path: Path) -> None:
        self.write(tmp_path, [0])
        frame, _ = self.frame(0)
        view = frame.views["left"]
        sample = self.sample(0)
        lines = parse_labels((tmp_path / "val/label_2/000000.txt").read_text())
        assert len(lines) == len(sample.objects) > 5
        for thing, line in zip(sample.objects, lines, strict=True):
            seen = frame.geoms.object_id[np.maximum(view.geom_id, 0)] == thing.object_id
            rows, columns = np.nonzero(seen & (view.geom_id >= 0))
            left, top, right, bottom = line.box_px
            # The box holds every visible pixel, and is no larger than a box that is in full view.
            assert left <= columns.min() + 0.51 and right >= columns.max() - 0.51
            assert top <= rows.min() + 0.51 and bottom >= rows.max() - 0.51
            if thing.kitti_type == "Car" and thing.occluded_fraction == 0 and thing.truncated == 0:
                assert [left, top, right, bottom] == pytest.approx(
                    [columns.min(), rows.min(), columns.max(), rows.max()], abs=1.01
                )


def label(thing: Thing, **options: Any) -> Any:
    task = Stereo3dTask(Stereo3dConfig(width_px=1224, height_px=370, **options))
    (found,) = task.ground_truth(*synthetic_frame(task.rig(), [thing])).objects
    return found


def car(ahead_m: float, left_m: float, yaw_rad: float, parts: Any = CAR) -> Thing:
    return Thing(parts=parts, position_m=(ahead_m, left_m, 0.0), yaw_rad=yaw_rad, object_id=2, role="npc")


def test_the_published_test_vector() -> None:
    # Camera at UE (10, 5, 1.65) yaw 30 deg; car at UE (22, 14, 0) yaw 75 deg; y and yaw change sign in gear's world.
    # The ego frame of this test is the world; its camera sits at the ego's (1.5, 0, 1.65).
    from gear.values.geometry import RigidTransform

    yaw = math.radians(-30)
    ego = (10 - 1.5 * math.cos(yaw), -5 - 1.5 * math.sin(yaw), 0.0)
    world_from_ego = RigidTransform.from_yaw("world", "ego", ego, yaw)
    position = world_from_ego.inverse().apply([22.0, -14.0, 0.0])
    thing = Thing(parts=CAR, position_m=tuple(position), yaw_rad=math.radians(-75) - yaw, object_id=2, role="npc")
    task = Stereo3dTask(Stereo3dConfig())
    (found,) = task.ground_truth(*synthetic_frame(task.rig(), [thing], world_from_ego=world_from_ego)).objects
    line = found.label()
    assert line.location_m == pytest.approx((1.794, 1.650, 14.892), abs=6e-4)
    assert line.rotation_y_rad == pytest.approx(-0.7854, abs=6e-5)
    assert line.alpha_rad == pytest.approx(-0.9053, abs=6e-5)
    assert line.box_px == pytest.approx((597.25, 189.90, 763.74, 263.57), abs=6e-3)
    assert (line.height_m, line.width_m, line.length_m) == pytest.approx((1.5, 1.8, 4.2))


@pytest.mark.parametrize(("yaw_deg", "rotation_y_deg"), [(0, -90), (180, 90), (-90, 0), (90, -180), (30, -120)])
def test_rotation_y_by_kittis_definition(yaw_deg: float, rotation_y_deg: float) -> None:
    found = label(car(14.0, 0.0, math.radians(yaw_deg)))
    difference = math.radians(rotation_y_deg) - found.box.rotation_y_rad
    assert math.cos(difference) == pytest.approx(1.0)


def test_truncation_is_the_share_outside() -> None:
    assert label(car(14.0, 0.0, 0.0)).truncated == 0
    cut = label(car(6.0, 4.2, 0.0))
    assert 0.05 < cut.truncated < 0.95
    assert cut.box_px[0] == 0


def test_the_evaluation_is_that_of_the_label_files() -> None:
    """The devkit reads 0.15, which is easy, where 0.1532 would not be."""
    task = Stereo3dTask(Stereo3dConfig(width_px=306, height_px=92))
    sample = task.ground_truth(*synthetic_frame(task.rig(), []))
    thing = replace(label(car(14.0, 0.0, 0.0)), truncated=0.1532, occluded=0, is_ignored=False)
    sample = replace(sample, objects=(thing,))
    evaluators = {"task": task.evaluator(), **task.reports()}
    for _ in range(60):
        for evaluator in evaluators.values():
            evaluator.update(sample, task.as_prediction(sample))
    assert evaluators["task"].result()["car_2d_easy_r40"] == pytest.approx(1)
    assert evaluators["reference"].result()["car_bev_easy_r40"] == pytest.approx(1)


def test_a_car_beside_the_camera_is_truncated_not_turned_inside_out() -> None:
    beside = label(car(2.5, 2.2, 0.0))
    left, top, right, bottom = beside.box_px
    assert 0 <= left < right <= 1223 and 0 <= top < bottom <= 369
    assert beside.truncated > 0.9


def test_a_cyclist_is_one_object() -> None:
    assert label(car(10.0, 0.0, 0.0, CYCLIST)).kitti_type == "Cyclist"


def test_a_van_is_no_car() -> None:
    assert label(car(10.0, 0.0, 0.0, VAN)).kitti_type == "Van"


def test_what_is_too_far_becomes_dont_care() -> None:
    from gear.groundtruth.visibility import VisibilityLimits

    found = label(car(30.0, 0.0, 0.0), visibility=VisibilityLimits(max_distance_m=20.0))
    assert found.label().type == "DontCare"
    assert found.label().box_px == found.box_px


def test_an_empty_road_has_an_empty_label_file() -> None:
    task = Stereo3dTask(Stereo3dConfig(width_px=306, height_px=92))
    sample = task.ground_truth(*synthetic_frame(task.rig(), []))
    from gear.testing.task_contract import INFO

    assert task.encode(sample, INFO).files["val/label_2/000000.txt"] == b""


def test_a_bad_baseline_is_refused() -> None:
    with pytest.raises(FieldError, match="baseline_m"):
        Stereo3dConfig(baseline_m=0.0)
