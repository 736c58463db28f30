"""The torch module of AdaBins (Bhat et al., CVPR 2021), written from the paper, with the parameter names of the
published weights.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from gear.networks.depth.options import AdaBinsOptions, BinsOptions
from gear.networks.depth.packages import need_timm

TAPPED = (0, 1, 2, 4)
"""Indices of the encoder's blocks from whose outputs the decoder reads, at 1/2, 1/4, 1/8 and 1/16 of the picture's
sides.
"""

PATCH_PX = 16
"""Side, in cells of the feature map, of the square patch that becomes one transformer token. The feature map has
half the picture's height and width.
"""

MOST_PATCHES = 500
"""Number of position encodings in the transformer, and therefore the largest number of tokens."""

HIDDEN = 256
LEAST_WIDTH = 0.1
"""Value added to the width of every depth bin before normalisation; it keeps bins from being empty."""


class BinsGraph(nn.Module):
    """An encoder with the head of AdaBins: a decoder, and a small transformer that chooses the depth bins anew for
    each picture.

    Args:
        encoder: module that returns five feature maps of normalised pictures, at 1/2, 1/4, 1/8, 1/16 and 1/32 of their
            sides.
        widths: number of channels of each feature map, from the finest to the coarsest.
        options: sizes of the head, and the range of depths.
    """

    def __init__(self, encoder: nn.Module, widths: Sequence[int], options: BinsOptions) -> None:
        super().__init__()
        self.range_m = (options.min_depth_m, options.max_depth_m)
        self.encoder = encoder
        self.decoder = Decoder(widths, options.features, options.width)
        self.adaptive_bins_layer = AdaptiveBins(options.width, options.queries, options.bins)
        self.conv_out = nn.Sequential(nn.Conv2d(options.queries, options.bins, 1), nn.Softmax(dim=1))

    def forward(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Predicts a depth map and the centres of the depth bins.

        Args:
            pictures: (B, 3, H, W), normalised; `patches(H, W)`, the number of tokens, must lie between queries + 1 and
                500.

        Returns:
            (B, 1, ceil(H / 2), ceil(W / 2)) depth in metres, and (B, bins) ascending bin centres in metres.
        """
        widths, maps = self.adaptive_bins_layer(self.decoder(self.encoder(pictures)))
        shares = self.conv_out(maps)
        least_m, most_m = self.range_m
        right_m = least_m + (most_m - least_m) * widths.float().cumsum(1)
        centres_m = right_m - (most_m - least_m) * widths.float() / 2
        return (shares.float() * centres_m[:, :, None, None]).sum(1, keepdim=True), centres_m


class AdaBinsGraph(BinsGraph):
    """AdaBins with an EfficientNet of timm as encoder, as published.

    Args:
        options: sizes of the network, and the range of depths.
    """

    def __init__(self, options: AdaBinsOptions) -> None:
        encoder = Encoder(options.encoder)
        super().__init__(encoder, encoder.widths(), options)


class Encoder(nn.Module):
    """The encoder of AdaBins: an EfficientNet of timm without its classifier.

    Args:
        name: timm's name of the EfficientNet.
    """

    original_model: Any

    def __init__(self, name: str) -> None:
        super().__init__()
        need_timm()
        import timm

        self.original_model = timm.create_model(name, pretrained=False)
        self.original_model.global_pool = nn.Identity()
        self.original_model.classifier = nn.Identity()

    def widths(self) -> list[int]:
        """Number of channels of each of the five feature maps, from the finest to the coarsest."""
        channels = {entry["module"]: entry["num_chs"] for entry in self.original_model.feature_info}
        return [*(channels[f"blocks.{index}"] for index in TAPPED), self.original_model.conv_head.out_channels]

    def forward(self, pictures: Tensor) -> list[Tensor]:
        """Returns the feature maps of pictures at 1/2, 1/4, 1/8, 1/16 and 1/32 of their sides.

        The coarsest map is taken before its normalisation layer.

        Args:
            pictures: (B, 3, H, W), normalised.
        """
        network = self.original_model
        found = network.bn1(network.conv_stem(pictures))
        maps = []
        for index, block in enumerate(network.blocks):
            found = block(found)
            if index in TAPPED:
                maps.append(found)
        return [*maps, network.conv_head(found)]


class Decoder(nn.Module):
    """The decoder of AdaBins: four upsampling steps, each of which also receives a feature map of the encoder.

    Args:
        widths: numbers of channels of the encoder's five maps, from the finest to the coarsest.
        features: number of channels of the widest layer; each step halves it.
        width: number of channels of the result.
    """

    def __init__(self, widths: Sequence[int], features: int, width: int) -> None:
        super().__init__()
        half, quarter, eighth, sixteenth, deepest = widths
        # The padding of this 1x1 convolution enlarges its map by two pixels. The published weights were trained so.
        self.conv2 = nn.Conv2d(deepest, features, 1, padding=1)
        self.up1 = Up(features + sixteenth, features // 2)
        self.up2 = Up(features // 2 + eighth, features // 4)
        self.up3 = Up(features // 4 + quarter, features // 8)
        self.up4 = Up(features // 8 + half, features // 16)
        self.conv3 = nn.Conv2d(features // 16, width, 3, padding=1)

    def forward(self, maps: Sequence[Tensor]) -> Tensor:
        """Returns the (B, width, H / 2, W / 2) features of (B, 3, H, W) pictures.

        Args:
            maps: the encoder's five feature maps, from the finest to the coarsest.
        """
        half, quarter, eighth, sixteenth, deepest = maps
        found = self.up1(self.conv2(deepest), sixteenth)
        found = self.up2(found, eighth)
        found = self.up3(found, quarter)
        features: Tensor = self.conv3(self.up4(found, half))
        return features


class Up(nn.Module):
    """One upsampling step: the coarse map is interpolated to the size of the encoder's map, then two convolutions
    process both maps.

    Args:
        inputs: number of channels of both maps together.
        outputs: number of channels of the result.
    """

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self._net = nn.Sequential(
            nn.Conv2d(inputs, outputs, 3, padding=1), nn.BatchNorm2d(outputs), nn.LeakyReLU(),
            nn.Conv2d(outputs, outputs, 3, padding=1), nn.BatchNorm2d(outputs), nn.LeakyReLU(),
        )  # fmt: skip

    def forward(self, coarse: Tensor, beside: Tensor) -> Tensor:
        """Returns the (B, outputs, h, w) features with the height and width of the encoder's map.

        Args:
            coarse: (B, C, h', w') result of the step before.
            beside: (B, C', h, w) map of the encoder; C + C' is `inputs`.
        """
        enlarged = functional.interpolate(coarse, beside.shape[2:], mode="bilinear", align_corners=True)
        found: Tensor = self._net(torch.cat([enlarged, beside], dim=1))
        return found


class AdaptiveBins(nn.Module):
    """The mini-ViT of AdaBins (Bhat et al., section 3.2): a transformer that predicts the widths of the depth
    bins, and attention maps.

    Args:
        width: number of channels of the features and of the tokens.
        queries: number of tokens that are compared with the features; one attention map each.
        bins: number of depth bins.
    """

    def __init__(self, width: int, queries: int, bins: int) -> None:
        super().__init__()
        self.queries = queries
        self.patch_transformer = PatchTransformer(width)
        self.conv3x3 = nn.Conv2d(width, width, 3, padding=1)
        self.regressor = nn.Sequential(
            nn.Linear(width, HIDDEN), nn.LeakyReLU(), nn.Linear(HIDDEN, HIDDEN), nn.LeakyReLU(), nn.Linear(HIDDEN, bins)
        )

    def forward(self, features: Tensor) -> tuple[Tensor, Tensor]:
        """Returns the (B, bins) bin widths as shares of the depth range, with sum 1, and the (B, queries, h, w)
        attention maps.

        Args:
            features: (B, width, h, w) output of the decoder.
        """
        tokens = self.patch_transformer(features)
        widths = functional.relu(self.regressor(tokens[0])) + LEAST_WIDTH
        queries = tokens[1 : self.queries + 1]
        maps = torch.einsum("qbc,bchw->bqhw", queries, self.conv3x3(features))
        return widths / widths.sum(1, keepdim=True), maps


class PatchTransformer(nn.Module):
    """A transformer encoder with four layers of self-attention over the patches of a feature map.

    Args:
        width: number of channels of the feature map and of the tokens.
    """

    def __init__(self, width: int) -> None:
        super().__init__()
        layer = nn.TransformerEncoderLayer(width, nhead=4, dim_feedforward=1024)
        self.transformer_encoder = nn.TransformerEncoder(layer, num_layers=4, enable_nested_tensor=False)
        self.embedding_convPxP = nn.Conv2d(width, width, PATCH_PX, stride=PATCH_PX)
        self.positional_encodings = nn.Parameter(torch.rand(MOST_PATCHES, width))

    def forward(self, features: Tensor) -> Tensor:
        """Returns the (patches, B, width) tokens of the feature map's patches; patches are ordered row by row.

        Args:
            features: (B, width, h, w) output of the decoder, with at most 500 patches of 16 x 16 cells.
        """
        patches = self.embedding_convPxP(features).flatten(2).permute(2, 0, 1)
        tokens: Tensor = self.transformer_encoder(patches + self.positional_encodings[: len(patches), None])
        return tokens


def patches(height: int, width: int) -> int:
    """Returns the number of transformer tokens (patches) for a picture.

    Args:
        height, width: size of the picture in pixels.
    """
    rows, columns = (-(-side // 2) // PATCH_PX for side in (height, width))
    return rows * columns


def fitting(height: int, width: int, min_patches: int, max_patches: int = MOST_PATCHES) -> tuple[int, int]:
    """Returns the picture size, at the same aspect ratio, whose number of transformer tokens is allowed and which
    is nearest to the given one.

    Args:
        height, width: size of the picture in pixels.
        min_patches, max_patches: smallest and largest allowed number of patches (transformer tokens).

    Returns:
        Height and width.
    """
    count = patches(height, width)
    if min_patches <= count <= max_patches:
        return height, width
    below, above = (0.0, 1.0) if count > max_patches else (1.0, 64.0)
    for _ in range(30):
        middle = (below + above) / 2
        enough = patches(round(height * middle), round(width * middle)) > (
            max_patches if count > max_patches else min_patches - 1
        )
        below, above = (below, middle) if enough else (middle, above)
    scale = below if count > max_patches else above
    return round(height * scale), round(width * scale)
