"""Options of the depth networks. The module does not import torch, so plugin specs load quickly."""

from __future__ import annotations

import re
from dataclasses import dataclass

from gear.networks.options import LARGEST_SCALE, NetworkOptions
from gear.values.errors import FieldError

STAGES = 4
"""Number of stages of a mix transformer."""

HEADS = (1, 2, 5, 8)
"""Number of attention heads in each of the four stages of a mix transformer; all sizes (b0 to b5) have the same
numbers.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthOptions(NetworkOptions):
    """Options that every depth network has. They include the options of `NetworkOptions`.

    Attributes:
        max_depth_m: greatest depth used in training, metres; networks with a bounded output predict no greater depth.
        input_scale: factor by which pictures are resized before the network; the depth is resized back. null takes the
            factor with which the weights were trained, or the network's default if the weights state none.
    """

    max_depth_m: float = 80.0
    input_scale: float | None = None

    def __post_init__(self) -> None:
        if not self.max_depth_m > 0:
            raise FieldError("max_depth_m", f"must be above 0 m, got {self.max_depth_m:g}")
        if self.input_scale is not None and not 0 < self.input_scale <= LARGEST_SCALE:
            raise FieldError("input_scale", f"must be above 0 and at most {LARGEST_SCALE:g}, got {self.input_scale:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class GlpnOptions(DepthOptions):
    """Options of GLPDepth; the defaults are those of the published weights, with the encoder MiT-b4. They include
    the options of `DepthOptions`.

    Attributes:
        blocks: number of transformer blocks in each of the four stages.
        widths: number of channels of each stage, divisible by 1, 2, 5 and 8 (its number of attention heads).
        decoder_width: number of channels of the decoder.
    """

    blocks: tuple[int, int, int, int] = (3, 8, 27, 3)
    widths: tuple[int, int, int, int] = (64, 128, 320, 512)
    decoder_width: int = 64

    def __post_init__(self) -> None:
        DepthOptions.__post_init__(self)
        if min(self.blocks) < 1:
            raise FieldError("blocks", f"every stage needs at least 1 block, got {self.blocks}")
        if any(width < 1 or width % heads for width, heads in zip(self.widths, HEADS, strict=True)):
            raise FieldError("widths", f"must be divisible by {HEADS}, got {self.widths}")
        if self.decoder_width < 2 or self.decoder_width % 2:
            raise FieldError("decoder_width", f"must be even and above 0, got {self.decoder_width}")


@dataclass(frozen=True, slots=True, kw_only=True)
class GlpnB0Options(GlpnOptions):
    """Options of GLPDepth with the smallest encoder, MiT-b0; they are those of `GlpnOptions` with other defaults."""

    blocks: tuple[int, int, int, int] = (2, 2, 2, 2)
    widths: tuple[int, int, int, int] = (32, 64, 160, 256)
    decoder_width: int = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class BinsOptions(DepthOptions):
    """Options of the networks with the head of AdaBins; the defaults are those of the published weights. They include
    the options of `DepthOptions`.

    Attributes:
        features: number of channels of the decoder's widest layer, divisible by 16; each further layer has half as
            many.
        width: number of channels of the decoder's output and of the transformer's tokens, divisible by 4 (the number
            of attention heads).
        bins: number of depth bins.
        queries: number of transformer tokens that are compared with the feature map.
        min_depth_m: lower end of the depth range, metres.
    """

    features: int = 2048
    width: int = 128
    bins: int = 256
    queries: int = 128
    min_depth_m: float = 1e-3

    def __post_init__(self) -> None:
        DepthOptions.__post_init__(self)
        if self.features < 16 or self.features % 16:
            raise FieldError("features", f"must be divisible by 16 and above 0, got {self.features}")
        if self.width < 4 or self.width % 4:
            raise FieldError("width", f"must be divisible by 4 and above 0, got {self.width}")
        if self.bins < 2:
            raise FieldError("bins", f"must be at least 2, got {self.bins}")
        if not 1 <= self.queries <= 400:
            raise FieldError("queries", f"must be 1 to 400, got {self.queries}")
        if not 0 < self.min_depth_m < self.max_depth_m:
            raise FieldError("min_depth_m", f"must be above 0 and below max_depth_m, got {self.min_depth_m:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class AdaBinsOptions(BinsOptions):
    """Options of AdaBins. They include the options of `BinsOptions`.

    Attributes:
        encoder: an EfficientNet of timm, `tf_efficientnet_b0` to `tf_efficientnet_b8`.
    """

    encoder: str = "tf_efficientnet_b5"

    def __post_init__(self) -> None:
        BinsOptions.__post_init__(self)
        if not re.fullmatch("tf_efficientnet_b[0-8]", self.encoder):
            raise FieldError("encoder", f"must be tf_efficientnet_b0 to tf_efficientnet_b8, got {self.encoder!r}")


@dataclass(frozen=True, slots=True, kw_only=True)
class AdaBinsLite0Options(BinsOptions):
    """Options of AdaBins' head on EfficientNet-Lite0; they are those of `BinsOptions` with smaller defaults."""

    features: int = 256
    width: int = 64
    bins: int = 128
    queries: int = 64
