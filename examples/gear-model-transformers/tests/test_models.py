"""Every promise of a model, for two families a task, and the answers that the families' own code gives."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
import pytest
import tiny_folders
import torch
import transformers
from gear.contracts.models import Model
from gear.testing.model_contract import ModelContract
from gear.values.errors import FieldError, GearError

from gear_model_transformers import DepthConfig, DetectorConfig, LabelledConfig, depth, detect2d, semseg

SIZE = (64, 128)


class FolderContract(ModelContract):
    network: ClassVar[Callable[[Path], Path]]
    extra: ClassVar[dict[str, Any]] = {}
    tolerance = 1e-3
    folder: ClassVar[Path]

    @pytest.fixture(autouse=True)
    def saved(self, tmp_path: Path) -> None:
        type(self).folder = type(self).network(tmp_path)

    def make(self) -> Model:
        return self.spec.build(self.spec.config(folder=str(self.folder), device="cpu", **self.extra))

    def street(self) -> npt.NDArray[np.uint8]:
        """(64, 128, 3), a picture."""
        picture: npt.NDArray[np.uint8] = self.samples(self.spec.tasks[0])[0].images["left"].copy()
        return picture

    def theirs(self) -> tuple[Any, Any]:
        """The processor, and what the network says of the street as Hugging Face's documentation would ask it."""
        model: Any = self.make()
        with torch.no_grad():
            return model.processor, model.network(**model.processor(images=self.street(), return_tensors="pt"))


class SegmenterContract(FolderContract):
    spec = semseg
    extra: ClassVar[dict[str, Any]] = {"classes": {"van": "truck", "tarmac": "terrain"}}
    agreement: ClassVar[float] = 0.97

    def test_pixels_are_the_familys_own(self) -> None:
        processor, said = self.theirs()
        (wanted,) = processor.post_process_semantic_segmentation(said, target_sizes=[SIZE])
        found = self.make().predict({"left": self.street()})
        assert len(wanted.unique()) > 1
        assert (np.array([7, 8, 27, 26, 22])[wanted.numpy()] == found).mean() > self.agreement


class TestSegformer(SegmenterContract):
    network = tiny_folders.segformer

    def test_classes_go_by_name_and_as_the_user_says(self) -> None:
        folder = str(self.folder)
        by_name: Any = semseg.build(LabelledConfig(folder=folder))
        assert [each for each in by_name.indices if each] == [[0], [1], [2, 3]]  # a van is a car, and tarmac nothing
        said: Any = semseg.build(LabelledConfig(folder=folder, classes={"tarmac": "road"}))
        assert [each for each in said.indices if each] == [[0, 4], [1], [2, 3]]
        for classes, problem in (({"moat": "road"}, "has no 'moat'"), ({"tarmac": "moat"}, "task has no 'moat'")):
            with pytest.raises(GearError, match=problem):
                semseg.build(LabelledConfig(folder=folder, classes=classes))


class TestMask2Former(SegmenterContract):
    network = tiny_folders.mask2former
    agreement = 0.93  # theirs goes through 384 x 384 pixels in between


class DepthContract(FolderContract):
    spec = depth

    def metres(self, said: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        return said

    def test_depth_is_the_familys_own(self) -> None:
        processor, said = self.theirs()
        (wanted,) = processor.post_process_depth_estimation(said, target_sizes=[SIZE])
        metres = self.metres(wanted["predicted_depth"].numpy())
        assert metres.std() > 0
        np.testing.assert_allclose(self.make().predict({"left": self.street()}), metres, rtol=0.02)


class TestGlpn(DepthContract):
    network = tiny_folders.glpn


class TestDepthAnything(DepthContract):
    network = tiny_folders.depth_anything
    extra: ClassVar[dict[str, Any]] = {"inverse_scale": 0.5, "inverse_shift": 0.02}

    def metres(self, said: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        return 1 / (0.5 * said + 0.02)

    def test_relative_depth_has_to_be_made_metres_and_metric_depth_must_not(self, tmp_path: Path) -> None:
        with pytest.raises(GearError, match="set inverse_scale"):
            depth.build(DepthConfig(folder=str(self.folder)))
        metric = str(tiny_folders.depth_anything(tmp_path / "metric", "metric"))
        with pytest.raises(GearError, match="leave inverse_scale at 0"):
            depth.build(DepthConfig(folder=metric, inverse_scale=1.0))
        assert depth.build(DepthConfig(folder=metric))


class DetectorContract(FolderContract):
    spec = detect2d
    extra: ClassVar[dict[str, Any]] = {"score_threshold": 0.0}

    def test_boxes_are_the_familys_own(self) -> None:
        processor, said = self.theirs()
        (wanted,) = processor.post_process_object_detection(said, threshold=0.0, target_sizes=[SIZE])
        category_ids = {0: 1, 1: 4, 2: 10}  # person, motorcycle, traffic light; COCO has no unicorn
        theirs = [
            (score, category_ids[label], box)
            for score, label, box in zip(*(wanted[key].tolist() for key in ("scores", "labels", "boxes")), strict=True)
            if label in category_ids
        ]
        found = self.make().predict({"left": self.street()})
        assert len(found) == len(theirs) > 3
        assert [one.score for one in found] == sorted((one.score for one in found), reverse=True)
        for one, (score, category_id, box) in zip(found, sorted(theirs, key=lambda it: -it[0]), strict=True):
            assert one.category_id == category_id and one.score == pytest.approx(score, abs=2e-3)
            np.testing.assert_allclose(one.box_px, np.clip(box, 0, [128, 64, 128, 64]), atol=0.5)


class TestDetr(DetectorContract):
    network = tiny_folders.detr


class TestRtDetr(DetectorContract):
    network = tiny_folders.rt_detr


@pytest.mark.parametrize("folder", ["", "nowhere"])
def test_a_missing_folder_gets_one_line(folder: str) -> None:
    with pytest.raises(GearError, match="save_pretrained"):
        semseg.build(LabelledConfig(folder=folder))


def test_a_folder_of_another_kind_gets_one_line(tmp_path: Path) -> None:
    with pytest.raises(GearError, match="no network for SemanticSegmentation or UniversalSegmentation"):
        semseg.build(LabelledConfig(folder=str(tiny_folders.glpn(tmp_path))))


def test_a_network_whose_head_is_missing_is_refused(tmp_path: Path) -> None:
    """transformers itself would give it a random one."""
    config = transformers.SegformerConfig(**tiny_folders.MIT)
    transformers.SegformerForImageClassification(config).save_pretrained(tmp_path)
    with pytest.raises(GearError, match="weights of SegformerForSemanticSegmentation are not there"):
        semseg.build(LabelledConfig(folder=str(tmp_path)))


def test_absurd_options_are_refused() -> None:
    with pytest.raises(FieldError, match="inverse_scale"):
        DepthConfig(inverse_scale=-1.0)
    with pytest.raises(FieldError, match="score_threshold"):
        DetectorConfig(score_threshold=2.0)


def test_a_folder_with_code_of_its_own_never_runs_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder, marker = tiny_folders.segformer(tmp_path), tmp_path / "ran"
    (folder / "own.py").write_text(f"open({str(marker)!r}, 'w').close()\nclass Config: ...\nclass Net: ...\n")
    config = json.loads((folder / "config.json").read_text())
    config |= {
        "model_type": "own",
        "auto_map": {"AutoConfig": "own.Config", "AutoModelForSemanticSegmentation": "own.Net"},
    }
    (folder / "config.json").write_text(json.dumps(config))
    monkeypatch.setattr("builtins.input", lambda *_: "y")
    with pytest.raises(GearError, match="no network for SemanticSegmentation"):
        semseg.build(LabelledConfig(folder=str(folder), device="cpu"))
    assert not marker.exists()


def test_halved_weights_are_used_whole(tmp_path: Path) -> None:
    folder = tiny_folders.segformer(tmp_path)
    transformers.AutoModelForSemanticSegmentation.from_pretrained(folder).half().save_pretrained(folder)
    model = semseg.build(LabelledConfig(folder=str(folder), device="cpu", classes={"tarmac": "terrain"}))
    assert model.predict({"left": np.zeros((*SIZE, 3), np.uint8)}).shape == SIZE
