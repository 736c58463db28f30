"""Real architectures of transformers, tiny, with random weights, in folders."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import torch

from gear.networks import torchvision_import

torchvision_import.prepare()

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


def upernet() -> Any:
    backbone = transformers.ConvNextConfig(
        hidden_sizes=[8, 8, 16, 16], depths=[1] * 4, out_features=["stage1", "stage2", "stage3", "stage4"]
    )
    return transformers.UperNetForSemanticSegmentation(
        transformers.UperNetConfig(
            backbone_config=backbone, hidden_size=8, pool_scales=[1, 2], id2label=CITY, auxiliary_in_channels=16,
            auxiliary_channels=8, use_auxiliary_head=True,
        )
    )  # fmt: skip


def beit() -> Any:
    return transformers.BeitForSemanticSegmentation(
        transformers.BeitConfig(
            hidden_size=16, num_hidden_layers=4, num_attention_heads=2, intermediate_size=16, image_size=64,
            out_indices=[0, 1, 2, 3], pool_scales=[1, 2], id2label=CITY, auxiliary_channels=8, num_labels=5,
        )
    )  # fmt: skip


def dpt() -> Any:
    backbone = transformers.Dinov2Config(
        hidden_size=16, num_hidden_layers=4, num_attention_heads=2, image_size=70, patch_size=14,
        out_indices=[1, 2, 3, 4], reshape_hidden_states=False,
    )  # fmt: skip
    return transformers.DPTForDepthEstimation(
        transformers.DPTConfig(
            backbone_config=backbone, neck_hidden_sizes=[8] * 4, fusion_hidden_size=8, is_hybrid=False,
            use_batch_norm_in_fusion_residual=False, reassemble_factors=[4, 2, 1, 0.5],
        )
    )  # fmt: skip


def zoedepth() -> Any:
    backbone = transformers.BeitConfig(
        hidden_size=16, num_hidden_layers=4, num_attention_heads=2, intermediate_size=16, image_size=64,
        out_indices=[1, 2, 3, 4], reshape_hidden_states=False, use_relative_position_bias=True,
    )  # fmt: skip
    return transformers.ZoeDepthForDepthEstimation(
        transformers.ZoeDepthConfig(
            backbone_config=backbone, backbone_hidden_size=16, neck_hidden_sizes=[8] * 4, fusion_hidden_size=8,
            bottleneck_features=8, num_relative_features=8, bin_embedding_dim=8, num_attractors=[4, 2, 2, 1],
            bin_configurations=[{"n_bins": 8, "min_depth": 0.001, "max_depth": 80.0, "name": "street"}],
        )
    )  # fmt: skip


def _resnet() -> Any:
    return transformers.ResNetConfig(
        embedding_size=8, hidden_sizes=[8, 8, 16, 16], depths=[1] * 4, layer_type="basic",
        out_features=["stage2", "stage3", "stage4"],
    )  # fmt: skip


DETR: dict[str, Any] = {
    "d_model": 16, "encoder_layers": 1, "decoder_layers": 2, "encoder_attention_heads": 2, "decoder_attention_heads": 2,
    "encoder_ffn_dim": 16, "decoder_ffn_dim": 16, "num_queries": 6, "use_timm_backbone": False, "backbone": None,
    "use_pretrained_backbone": False, "id2label": COCO,
}  # fmt: skip


def detr(backbone: Any = None) -> Any:
    config = transformers.DetrConfig(backbone_config=backbone or _resnet(), **DETR)
    network = transformers.DetrForObjectDetection(config)
    network.class_labels_classifier.bias.data.copy_(torch.tensor([3.0, 3.0, 3.0, 0.0, 0.0]))  # unicorns are rare
    return network


def conditional_detr(backbone: Any = None) -> Any:
    config = transformers.ConditionalDetrConfig(backbone_config=backbone or _resnet(), **DETR)
    return transformers.ConditionalDetrForObjectDetection(config)


def deformable_detr(backbone: Any = None) -> Any:
    config = transformers.DeformableDetrConfig(
        backbone_config=backbone or _resnet(), num_feature_levels=3, **DETR | {"d_model": 32}
    )
    return transformers.DeformableDetrForObjectDetection(config)


def saved(make: Any, folder: Path, **processor: Any) -> Path:
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(3)
        make().save_pretrained(folder)
    if processor:
        (folder / "preprocessor_config.json").write_text(json.dumps(processor))
    return folder
