"""Every promise of a model, for tiny networks with random weights in temporary folders."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import torch
import transformers
from gear.contracts.models import Model
from gear.testing.model_contract import ModelContract
from gear.values.errors import GearError

from gear_model_transformers import FolderConfig, depth, detect2d, semseg

CITY = {0: "road", 1: "sidewalk", 2: "car", 3: "sky"}
COCO = {0: "person", 1: "car", 2: "banana"}
SIZES: dict[str, Any] = {
    "num_encoder_blocks": 4,
    "depths": [1, 1, 1, 1],
    "hidden_sizes": [8, 8, 16, 16],
    "num_attention_heads": [1, 1, 2, 2],
    "decoder_hidden_size": 16,
}


def tiny(kind: str) -> Any:
    torch.manual_seed(3)
    if kind == "semseg":
        return transformers.SegformerForSemanticSegmentation(transformers.SegformerConfig(id2label=CITY, **SIZES))
    if kind == "depth":
        return transformers.GLPNForDepthEstimation(transformers.GLPNConfig(**SIZES))
    config = transformers.YolosConfig(
        hidden_size=16,
        num_hidden_layers=1,
        num_attention_heads=2,
        intermediate_size=16,
        image_size=[64, 128],
        num_detection_tokens=5,
        use_mid_position_embeddings=False,
        id2label=COCO,
    )
    return transformers.YolosForObjectDetection(config)


class FolderContract(ModelContract):
    kind = "semseg"
    folder: Path

    @pytest.fixture(autouse=True)
    def saved(self, tmp_path: Path) -> Iterator[None]:
        type(self).folder = tmp_path
        tiny(self.kind).save_pretrained(tmp_path)
        yield

    def make(self) -> Model:
        return self.spec.build(FolderConfig(folder=str(self.folder), least_score=0.0))


class TestSegformer(FolderContract):
    spec = semseg

    def test_classes_go_by_name(self) -> None:
        sample = self.samples("semseg")[0]
        assert set(self.make().predict(self.views(sample)).flat) <= {7, 8, 26, 23}


class TestGlpn(FolderContract):
    spec = depth
    kind = "depth"


class TestYolos(FolderContract):
    spec = detect2d
    kind = "detect2d"
    tolerance = 1e-3

    def test_what_coco_does_not_call_by_that_name_is_kept_apart(self) -> None:
        found = self.make().predict(self.views(self.samples("detect2d")[0]))
        assert found and {one.category_id for one in found} <= {1, 3, 52}


@pytest.mark.parametrize("folder", ["", "nowhere"])
def test_a_missing_folder_gets_one_line(folder: str) -> None:
    with pytest.raises(GearError, match="save_pretrained"):
        semseg.build(FolderConfig(folder=folder))


def test_a_folder_of_another_kind_gets_one_line(tmp_path: Path) -> None:
    tiny("depth").save_pretrained(tmp_path)
    with pytest.raises(GearError, match="not a detect2d network"):
        detect2d.build(FolderConfig(folder=str(tmp_path)))
