"""Real architectures, tiny, with random weights, in folders as `save_pretrained` writes them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch
from gear.networks import torchvision_import

torchvision_import.prepare()  # before transformers: torchvision may not fit this torch

import transformers  # noqa: E402

CITY = {0: "road", 1: "sidewalk", 2: "van", 3: "car", 4: "tarmac"}
COCO = {0: "person", 1: "motorbike", 2: "traffic light", 3: "unicorn"}
MIT: dict[str, Any] = {"depths": [1] * 4, "hidden_sizes": [8, 8, 16, 16], "num_attention_heads": [1, 1, 2, 2]}
SMALL = {"height": 64, "width": 96}


def segformer(folder: Path) -> Path:
    config = transformers.SegformerConfig(id2label=CITY, decoder_hidden_size=16, **MIT)
    processor = transformers.SegformerImageProcessor(size=SMALL)
    return saved(lambda: transformers.SegformerForSemanticSegmentation(config), processor, folder)


def mask2former(folder: Path) -> Path:
    backbone = transformers.SwinConfig(
        image_size=64, embed_dim=8, depths=[1] * 4, num_heads=[1] * 4, window_size=4,
        out_features=["stage1", "stage2", "stage3", "stage4"],
    )  # fmt: skip
    config = transformers.Mask2FormerConfig(
        backbone_config=backbone, feature_size=32, mask_feature_size=32, hidden_dim=32, encoder_feedforward_dim=16,
        encoder_layers=1, decoder_layers=2, num_attention_heads=2, dim_feedforward=16, num_queries=6,
        init_std=1.0, id2label=CITY,
    )  # fmt: skip
    processor = transformers.Mask2FormerImageProcessor(size={"shortest_edge": 72, "longest_edge": 200})
    return saved(lambda: transformers.Mask2FormerForUniversalSegmentation(config), processor, folder)


def glpn(folder: Path) -> Path:
    config = transformers.GLPNConfig(decoder_hidden_size=16, **MIT)
    return saved(lambda: transformers.GLPNForDepthEstimation(config), transformers.GLPNImageProcessor(), folder)


def depth_anything(folder: Path, says: str = "relative") -> Path:
    backbone = transformers.Dinov2Config(
        hidden_size=16, num_hidden_layers=4, num_attention_heads=2, image_size=70, patch_size=14,
        out_indices=[1, 2, 3, 4], apply_layernorm=True, reshape_hidden_states=False,
    )  # fmt: skip
    config = transformers.DepthAnythingConfig(
        backbone_config=backbone, reassemble_hidden_size=16, neck_hidden_sizes=[8] * 4, fusion_hidden_size=8,
        head_hidden_size=8, depth_estimation_type=says, max_depth=80,
    )  # fmt: skip
    processor = transformers.DPTImageProcessor(
        size={"height": 70, "width": 70}, keep_aspect_ratio=True, ensure_multiple_of=14
    )
    return saved(lambda: transformers.DepthAnythingForDepthEstimation(config), processor, folder)


def detr(folder: Path) -> Path:
    backbone = transformers.ResNetConfig(
        embedding_size=8, hidden_sizes=[8, 8, 16, 16], depths=[1] * 4, layer_type="basic", out_features=["stage4"]
    )
    config = transformers.DetrConfig(
        backbone_config=backbone, use_timm_backbone=False, backbone=None, d_model=16, encoder_layers=1,
        decoder_layers=1, encoder_attention_heads=2, decoder_attention_heads=2, encoder_ffn_dim=16,
        decoder_ffn_dim=16, num_queries=8, id2label=COCO,
    )  # fmt: skip
    processor = transformers.DetrImageProcessor(size={"shortest_edge": 64, "longest_edge": 200})
    return saved(lambda: transformers.DetrForObjectDetection(config), processor, folder)


def rt_detr(folder: Path) -> Path:
    backbone = transformers.RTDetrResNetConfig(
        embedding_size=8, hidden_sizes=[8, 8, 16, 16], depths=[1] * 4, layer_type="basic",
        out_features=["stage2", "stage3", "stage4"],
    )  # fmt: skip
    config = transformers.RTDetrConfig(
        backbone_config=backbone, encoder_in_channels=[8, 16, 16], encoder_hidden_dim=16, encoder_ffn_dim=16,
        encoder_attention_heads=2, feat_strides=[8, 16, 32], d_model=16, decoder_in_channels=[16] * 3,
        decoder_ffn_dim=16, decoder_layers=2, decoder_attention_heads=2, num_queries=8, num_denoising=0, id2label=COCO,
    )  # fmt: skip
    processor = transformers.RTDetrImageProcessor(size=SMALL)
    return saved(lambda: transformers.RTDetrForObjectDetection(config), processor, folder)


def saved(make: Any, processor: Any, folder: Path) -> Path:
    """Weights follow from a seed; no other random number is touched."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(3)
        make().save_pretrained(folder)
    processor.save_pretrained(folder)
    return folder
