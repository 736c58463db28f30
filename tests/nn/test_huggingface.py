"""Networks of transformers from folders: real architectures, tiny, with random weights."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from gear.contracts.models import Model
from gear.nn import vision
from gear.nn.huggingface_labels import match
from gear.nn.huggingface_options import DepthFolderOptions, DetectorFolderOptions, FolderOptions
from gear.nn.weights import write
from gear.plugins.models.huggingface import depth, detect2d, semseg
from gear.testing.model_contract import ModelContract
from gear.values.errors import FieldError, GearError
from tests.nn.detector_samples import SMALL, street_samples

vision.prepare()

import transformers  # noqa: E402

CITY = {0: "road", 1: "sidewalk", 2: "van", 3: "car", 4: "banana"}
COCO = {0: "person", 1: "motorbike", 2: "traffic light", 3: "unicorn"}


def segformer() -> Any:
    sizes: dict[str, Any] = {"depths": [1] * 4, "hidden_sizes": [8, 8, 16, 16], "num_attention_heads": [1, 1, 2, 2]}
    return transformers.SegformerForSemanticSegmentation(
        transformers.SegformerConfig(id2label=CITY, decoder_hidden_size=16, **sizes)
    )


def glpn() -> Any:
    sizes: dict[str, Any] = {"depths": [1] * 4, "hidden_sizes": [8, 8, 16, 16], "num_attention_heads": [1, 1, 2, 2]}
    return transformers.GLPNForDepthEstimation(transformers.GLPNConfig(decoder_hidden_size=16, **sizes))


def depth_anything(kind: str = "relative") -> Any:
    backbone = transformers.Dinov2Config(
        hidden_size=16, num_hidden_layers=4, num_attention_heads=2, image_size=70, patch_size=14,
        out_indices=[1, 2, 3, 4], apply_layernorm=True, reshape_hidden_states=False,
    )  # fmt: skip
    return transformers.DepthAnythingForDepthEstimation(
        transformers.DepthAnythingConfig(
            backbone_config=backbone, reassemble_hidden_size=16, neck_hidden_sizes=[8] * 4, fusion_hidden_size=8,
            head_hidden_size=8, depth_estimation_type=kind, max_depth=80,
        )
    )  # fmt: skip


def yolos() -> Any:
    return transformers.YolosForObjectDetection(
        transformers.YolosConfig(
            hidden_size=16, num_hidden_layers=1, num_attention_heads=2, intermediate_size=16, image_size=[64, 128],
            num_detection_tokens=6, use_mid_position_embeddings=False, id2label=COCO,
        )
    )  # fmt: skip


def rt_detr() -> Any:
    backbone = transformers.RTDetrResNetConfig(
        embedding_size=8, hidden_sizes=[8, 8, 16, 16], depths=[1, 1, 1, 1], layer_type="basic",
        out_features=["stage2", "stage3", "stage4"]
    )  # fmt: skip
    return transformers.RTDetrForObjectDetection(
        transformers.RTDetrConfig(
            backbone_config=backbone, encoder_in_channels=[8, 16, 16], encoder_hidden_dim=16, encoder_ffn_dim=16,
            encoder_attention_heads=2, feat_strides=[8, 16, 32], d_model=16, decoder_in_channels=[16] * 3,
            decoder_ffn_dim=16, decoder_layers=2, decoder_attention_heads=2, num_queries=8, num_denoising=0,
            id2label=COCO,
        )
    )  # fmt: skip


def saved(make: Any, folder: Path, **processor: Any) -> Path:
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(3)
        make().save_pretrained(folder)
    if processor:
        (folder / "preprocessor_config.json").write_text(json.dumps(processor))
    return folder


class FolderContract(ModelContract):
    network: ClassVar[Any]
    processor: ClassVar[dict[str, Any]] = {}
    extra: ClassVar[dict[str, Any]] = {}
    tolerance = 1e-3
    folder: ClassVar[Path]

    @pytest.fixture(autouse=True)
    def in_a_folder(self, tmp_path: Path) -> None:
        type(self).folder = saved(type(self).network, tmp_path, **self.processor)

    def make(self) -> Model:
        return self.spec.build(self.spec.config(folder=str(self.folder), device="cpu", **self.extra))


class TestSegformer(FolderContract):
    spec = semseg
    network = segformer
    processor: ClassVar[dict[str, Any]] = {"size": {"height": 64, "width": 64}, "resample": 2}

    def test_classes_go_by_name(self) -> None:
        model: Any = self.make()
        assert model.unmatched == ("banana",)
        sample = self.samples("semseg")[0]
        assert set(model.predict(self.views(sample)).flat) <= {7, 8, 26}
        logits = model(self.batch([sample]))["logits"]
        theirs = model.graph(pixel_values=model.seen(self.batch([sample]))).logits
        small = theirs[:, [2, 3]].logsumexp(1)
        assert logits.shape == (1, 19, 64, 128) and bool((logits[:, 2] == -50).all())
        torch.testing.assert_close(logits[:, 13].mean(), small.mean(), rtol=1e-3, atol=1e-3)


class TestGlpn(FolderContract):
    spec = depth
    network = glpn
    processor: ClassVar[dict[str, Any]] = {"size_divisor": 32, "resample": 2, "do_rescale": True}


class TestDepthAnything(FolderContract):
    spec = depth
    network = depth_anything
    processor: ClassVar[dict[str, Any]] = {
        "size": {"height": 70, "width": 70}, "keep_aspect_ratio": True, "ensure_multiple_of": 14, "resample": 3
    }  # fmt: skip
    extra: ClassVar[dict[str, Any]] = {"inverse_scale": 0.5, "inverse_shift": 0.02}


class TestYolos(FolderContract):
    spec = detect2d
    network = yolos
    extra: ClassVar[dict[str, Any]] = {"least_score": 0.0}
    task_options = SMALL


class TestRtDetr(FolderContract):
    spec = detect2d
    network = rt_detr
    processor: ClassVar[dict[str, Any]] = {"size": {"height": 64, "width": 64}, "do_normalize": False}
    extra: ClassVar[dict[str, Any]] = {"least_score": 0.0}
    task_options = SMALL


@pytest.mark.parametrize(("make", "post"), [(yolos, "YolosImageProcessorPil"), (rt_detr, "RTDetrImageProcessorPil")])
def test_detections_are_those_of_the_processor(make: Any, post: str, tmp_path: Path) -> None:
    model: Any = detect2d.build(
        DetectorFolderOptions(folder=str(saved(make, tmp_path)), device="cpu", input_size="picture", least_score=0.2)
    )
    sample = street_samples(128, 64, 1)[0]
    with torch.no_grad():
        out = model.graph(
            pixel_values=model.seen(
                {"left": torch.from_numpy(sample.images["left"].copy()).permute(2, 0, 1)[None] / 255}
            )
        )
    processor = getattr(transformers, post, None) or getattr(transformers, post.removesuffix("Pil"))
    theirs = processor().post_process_object_detection(out, threshold=0.2, target_sizes=[(64, 128)])[0]
    wanted = [
        (score, model._categories[label])
        for score, label in zip(theirs["scores"].tolist(), theirs["labels"].tolist(), strict=True)
        if label in model._categories
    ]
    found = model.predict({"left": sample.images["left"]})
    assert model.unmatched == ("unicorn",)
    assert {one.category_id for one in found} <= {1, 4, 10}
    ours = [(one.score, one.category_id) for one in found]
    assert len(wanted) > 3
    np.testing.assert_allclose(sorted(ours), sorted(wanted), atol=1e-4)
    assert all(0 <= one.box_px[0] <= one.box_px[2] <= 128 for one in found)


def test_names_are_matched() -> None:
    known = {"road": 0, "car": 13, "motorcycle": 17, "vegetation": 8}
    names = {0: "Road, route", 1: "auto; car", 2: "minibike", 3: "tree", 4: "cheese", 5: "motorcycle"}
    assert match(names, known) == ({0: 0, 1: 13, 2: 17, 3: 8, 5: 17}, ("cheese",))


def test_a_folder_without_the_head_is_refused_rather_than_given_a_random_one(tmp_path: Path) -> None:
    folder = saved(segformer, tmp_path)
    state = load_file(folder / "model.safetensors")
    save_file(
        {k: v for k, v in state.items() if "decode_head" not in k}, folder / "model.safetensors", {"format": "pt"}
    )
    with pytest.raises(GearError, match="weights of SegformerForSemanticSegmentation are not there, such as decode"):
        semseg.build(FolderOptions(folder=str(folder)))


def test_relative_depth_must_be_made_metres_and_metric_depth_must_not(tmp_path: Path) -> None:
    relative = str(saved(depth_anything, tmp_path / "relative"))
    metric = str(saved(lambda: depth_anything("metric"), tmp_path / "metric"))
    with pytest.raises(GearError, match="set inverse_scale"):
        depth.build(DepthFolderOptions(folder=relative))
    with pytest.raises(GearError, match="leave inverse_scale at 0"):
        depth.build(DepthFolderOptions(folder=metric, inverse_scale=1.0))
    assert depth.build(DepthFolderOptions(folder=metric, device="cpu"))
    with pytest.raises(FieldError):
        DepthFolderOptions(inverse_scale=-1.0)


def test_other_weights_than_the_folders(tmp_path: Path) -> None:
    folder = str(saved(segformer, tmp_path))
    one, two = (semseg.build(FolderOptions(folder=folder, weights="none", seed=s, device="cpu")) for s in (1, 2))
    key = "decode_head.classifier.weight"
    first, other = (model.module().state_dict() for model in (one, two))  # type: ignore[attr-defined]
    assert not torch.equal(first[key], other[key])
    write(tmp_path / "trained.safetensors", first, {})
    options = FolderOptions(folder=folder, weights=str(tmp_path / "trained.safetensors"), device="cpu")
    trained: Any = semseg.build(options)
    assert all(torch.equal(value, first[name]) for name, value in trained.module().state_dict().items())
