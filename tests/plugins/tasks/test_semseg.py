from pathlib import Path
from typing import Any, ClassVar

import cv2
import numpy as np
import pytest

from gear.formats import cityscapes
from gear.plugins.tasks.semseg import LabelOptions, SemsegConfig, SemsegTask, semseg
from gear.testing.synthetic import synthetic_frame
from gear.testing.task_contract import TaskContract
from gear.testing.things import CAR, Part, Thing
from gear.values.errors import FieldError

SMALL = {"width_px": 512, "height_px": 256}


class TestSemseg(TaskContract):
    spec = semseg
    options: ClassVar = SMALL
    headline = "miou"

    def spoil(self, prediction: Any) -> Any:
        return np.roll(prediction, 12, axis=1)

    def test_files_agree_with_each_other(self, tmp_path: Path) -> None:
        self.write(tmp_path)
        for label_file in sorted(tmp_path.glob("gtFine/val/*/*_labelIds.png")):
            labels = cv2.imread(str(label_file), cv2.IMREAD_UNCHANGED)
            instances = cv2.imread(str(label_file).replace("labelIds", "instanceIds"), cv2.IMREAD_UNCHANGED)
            colours = cv2.imread(str(label_file).replace("labelIds", "color"), cv2.IMREAD_UNCHANGED)
            assert labels.dtype == np.uint8 and labels.ndim == 2
            assert instances.dtype == np.uint16 and instances.ndim == 2
            np.testing.assert_array_equal(np.where(instances >= 1000, instances // 1000, instances), labels)
            np.testing.assert_array_equal(colours[..., 2::-1], cityscapes.COLOURS[labels])
            assert (colours[..., 3] == 255).all()

    def test_only_classes_with_instances_have_numbers(self) -> None:
        instances = self.sample().instance_ids
        for value in np.unique(instances[instances >= 1000]):
            assert cityscapes.LABELS[value // 1000].has_instances

    def test_every_visible_object_is_one_instance(self) -> None:
        frame, _ = self.frame()
        sample = self.sample()
        view = frame.views["left"]
        for geom in np.unique(view.geom_id[view.geom_id >= 0]):
            if cityscapes.LABELS[sample.label_ids[view.geom_id == geom][0]].has_instances:
                assert len(np.unique(sample.instance_ids[view.geom_id == geom])) == 1

    def test_the_files_lie_where_the_loaders_look(self, tmp_path: Path) -> None:
        self.write(tmp_path)
        city = tmp_path / "leftImg8bit/val/geartown10aachen"
        assert [p.name for p in sorted(city.iterdir())] == [
            "geartown10aachen_000000_000000_leftImg8bit.png",
            "geartown10aachen_000001_000000_leftImg8bit.png",
        ]
        assert [p.name for p in (tmp_path / "leftImg8bit/val").iterdir()] == ["geartown10aachen"]
        assert (tmp_path / "gtFine/val/camera_billboard_info.json").is_file()

    def test_the_originals_loader_pairs_pictures_with_labels(self, tmp_path: Path) -> None:
        # Its rule: all pictures below the split, sorted; the suffix is cut for the names of three real cities only.
        sidecars = self.write(tmp_path)
        images = sorted((tmp_path / "leftImg8bit/val").rglob("*.png"))
        assert len(images) == len(sidecars)
        for image, sidecar in zip(images, sidecars, strict=True):
            assert any(city in image.name for city in ("aachen", "tubingen", "munster"))
            stem = image.name.removesuffix("leftImg8bit.png")
            label = tmp_path / "gtFine/val" / image.parent.name / f"{stem}gtFine_labelIds.png"
            expected = self.sample(sidecar.record.index).label_ids
            np.testing.assert_array_equal(cv2.imread(str(label), cv2.IMREAD_UNCHANGED), expected)


def test_default_camera_is_the_papers() -> None:
    (camera,) = SemsegTask(SemsegConfig()).rig().cameras
    assert (camera.width_px, camera.height_px) == (2048, 1024)
    assert camera.intrinsics.focal_px == pytest.approx(1024)
    assert camera.position_m == (1.5, 0.0, 1.65)


def test_the_ego_car_is_the_ego_vehicle() -> None:
    hood = Part(label="car", centre_m=(2.0, 0.0, 0.5), size_m=(3.0, 1.8, 1.0))
    ego = Thing(parts=(hood,), position_m=(2.0, 0.0, 0.0), object_id=1, role="ego")
    task = SemsegTask(SemsegConfig(width_px=256, height_px=128))
    sample = task.ground_truth(*synthetic_frame(task.rig(), [ego]))
    assert set(np.unique(sample.label_ids)) == {1, 7, 23}
    assert set(np.unique(sample.instance_ids)) == {1, 7, 23}


def test_coarse_labels_drop_thin_things_and_keep_the_rest() -> None:
    pole = Thing(parts=(Part(label="pole", centre_m=(0, 0, 3), size_m=(0.1, 0.1, 6)),), position_m=(12.0, 3.0, 0.0))
    car = Thing(parts=CAR, position_m=(12.0, -3.0, 0.0), object_id=2, role="npc")
    fine, coarse = (
        SemsegTask(SemsegConfig(width_px=512, height_px=256, labels=LabelOptions(granularity=name)))
        for name in ("fine", "coarse")
    )
    frame, record = synthetic_frame(fine.rig(), [pole, car])
    a, b = fine.ground_truth(frame, record), coarse.ground_truth(frame, record)
    assert (a.label_ids == 17).sum() > 100 and (b.label_ids == 17).sum() == 0
    assert (b.label_ids == 26).sum() == pytest.approx((a.label_ids == 26).sum(), rel=0.02)
    assert (a.label_ids != b.label_ids).mean() < 0.02


@pytest.mark.parametrize("window", [4, 1, 103])
def test_a_bad_window_is_refused(window: int) -> None:
    with pytest.raises(FieldError, match="coarse_window_px"):
        LabelOptions(coarse_window_px=window)
