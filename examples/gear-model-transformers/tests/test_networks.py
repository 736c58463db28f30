"""Every promise of a model, for a tiny network with random weights in a temporary folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import pytest
import torch
from gear.contracts.models import Model
from gear.nn.huggingface_options import FolderOptions
from gear.nn.vision import prepare
from gear.testing.model_contract import ModelContract
from gear.values.errors import GearError

from gear_model_transformers import universal

prepare()  # before transformers: torchvision may not fit this torch

import transformers  # noqa: E402

CITY = {0: "road", 1: "sidewalk", 2: "car", 3: "sky", 4: "banana"}


def mask2former() -> Any:
    backbone = transformers.SwinConfig(
        image_size=64, embed_dim=8, depths=[1, 1, 1, 1], num_heads=[1, 1, 1, 1], window_size=4,
        out_features=["stage1", "stage2", "stage3", "stage4"],
    )  # fmt: skip
    config = transformers.Mask2FormerConfig(
        backbone_config=backbone, feature_size=32, mask_feature_size=32, hidden_dim=32, encoder_feedforward_dim=16,
        encoder_layers=1, decoder_layers=2, num_attention_heads=2, dim_feedforward=16, num_queries=6, id2label=CITY,
    )  # fmt: skip
    torch.manual_seed(3)
    return transformers.Mask2FormerForUniversalSegmentation(config)


class TestMask2Former(ModelContract):
    spec = universal
    tolerance = 1e-3
    folder: ClassVar[Path]

    @pytest.fixture(autouse=True)
    def saved(self, tmp_path: Path) -> None:
        type(self).folder = tmp_path
        mask2former().save_pretrained(tmp_path)

    def make(self) -> Model:
        return universal.build(FolderOptions(folder=str(self.folder), device="cpu"))

    def test_pixels_go_to_the_class_that_the_processor_gives_them(self) -> None:
        model: Any = self.make()
        sample = self.samples("semseg")[0]
        assert model.unmatched == ("banana",)
        with torch.no_grad():
            seen = model.seen(self.batch([sample]))
            mine = model.their_logits(seen)
            theirs = model.graph(pixel_values=seen)
            processor = transformers.Mask2FormerImageProcessor()
            small = mine.shape[2:]
            (wanted,) = processor.post_process_semantic_segmentation(theirs, target_sizes=[(384, 384)])
            large = torch.nn.functional.interpolate(mine.exp(), (384, 384), mode="bilinear", align_corners=False)
        assert small[0] > 1 and (large[0].argmax(0) == wanted).float().mean() > 0.97
        assert set(model.predict(self.views(sample)).flat) <= {7, 8, 26, 23}


def test_a_missing_folder_gets_one_line() -> None:
    with pytest.raises(GearError, match="save_pretrained"):
        universal.build(FolderOptions(folder="nowhere"))


def test_a_folder_of_another_kind_gets_one_line(tmp_path: Path) -> None:
    sizes: dict[str, Any] = {"depths": [1] * 4, "hidden_sizes": [8, 8, 16, 16], "num_attention_heads": [1, 1, 2, 2]}
    transformers.GLPNForDepthEstimation(transformers.GLPNConfig(**sizes)).save_pretrained(tmp_path)
    with pytest.raises(GearError, match="no network for UniversalSegmentation"):
        universal.build(FolderOptions(folder=str(tmp_path)))
