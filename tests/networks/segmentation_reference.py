"""DDRNet-23-slim and BiSeNet-X39 once more, written from their descriptions as plain functions of a state dict.

Nothing here knows gear's modules: keys, order of operations, strides, paddings and interpolation are said anew.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as f


@dataclass
class State:
    """Tensors by key, below a prefix; remembers in `used` which ones were asked for."""

    tensors: Mapping[str, Tensor]
    used: set[str]
    prefix: str = ""

    def __getitem__(self, name: str) -> Tensor:
        self.used.add(self.prefix + name)
        return self.tensors[self.prefix + name]

    def has(self, name: str) -> bool:
        return self.prefix + name in self.tensors

    def at(self, name: str) -> State:
        return State(self.tensors, self.used, f"{self.prefix}{name}.")

    def conv(self, name: str, x: Tensor, stride: int = 1, groups: int = 1) -> Tensor:
        weight = self[f"{name}.weight"]
        bias = self[f"{name}.bias"] if self.has(f"{name}.bias") else None
        return f.conv2d(x, weight, bias, stride, padding=weight.shape[-1] // 2, groups=groups)

    def norm(self, name: str, x: Tensor) -> Tensor:
        inner = self.at(name)
        mean, var = inner["running_mean"], inner["running_var"]
        return f.batch_norm(x, mean, var, inner["weight"], inner["bias"], False, 0.0, 1e-5)


def resize(x: Tensor, size: tuple[int, int], *, corners: bool) -> Tensor:
    return f.interpolate(x, size=size, mode="bilinear", align_corners=corners)


def size_of(x: Tensor) -> tuple[int, int]:
    return x.shape[2], x.shape[3]


def short(s: State, x: Tensor, stride: int) -> Tensor:
    return s.norm("downsample.1", s.conv("downsample.0", x, stride)) if s.has("downsample.0.weight") else x


def basic(s: State, x: Tensor, stride: int) -> Tensor:
    y = f.relu(s.norm("bn1", s.conv("conv1", x, stride)))
    return s.norm("bn2", s.conv("conv2", y)) + short(s, x, stride)


def stage(s: State, x: Tensor, stride: int = 1) -> Tensor:
    return basic(s.at("1"), f.relu(basic(s.at("0"), x, stride)), 1)


def bottleneck(s: State, x: Tensor, stride: int) -> Tensor:
    y = f.relu(s.norm("bn1", s.conv("conv1", x)))
    y = f.relu(s.norm("bn2", s.conv("conv2", y, stride)))
    return s.norm("bn3", s.conv("conv3", y)) + short(s, x, stride)


def norm_relu_conv(s: State, x: Tensor, first: int = 0) -> Tensor:
    return s.conv(str(first + 2), f.relu(s.norm(str(first), x)))


def dappm(s: State, x: Tensor) -> Tensor:
    size = size_of(x)
    parts = [norm_relu_conv(s.at("scale0"), x)]
    pools = [f.avg_pool2d(x, 5, 2, 2), f.avg_pool2d(x, 9, 4, 4), f.avg_pool2d(x, 17, 8, 8), x.mean((2, 3), True)]
    for i, pooled in enumerate(pools, start=1):
        up = resize(norm_relu_conv(s.at(f"scale{i}"), pooled, 1), size, corners=False)
        parts.append(norm_relu_conv(s.at(f"process{i}"), up + parts[-1]))
    return norm_relu_conv(s.at("compression"), torch.cat(parts, 1)) + norm_relu_conv(s.at("shortcut"), x)


def ddr_head(s: State, x: Tensor) -> Tensor:
    y = s.conv("conv1", f.relu(s.norm("bn1", x)))
    return s.conv("conv2", f.relu(s.norm("bn2", y)))


def ddrnet(s: State, x: Tensor) -> list[Tensor]:
    """Main and auxiliary logits at 1/8; the sides are multiples of 8."""
    size = x.shape[2] // 8, x.shape[3] // 8
    stem = s.at("conv1")
    y = f.relu(stem.norm("1", stem.conv("0", x, 2)))
    y = f.relu(stem.norm("4", stem.conv("3", y, 2)))
    y = stage(s.at("layer1"), y)
    eighth = stage(s.at("layer2"), f.relu(y), 2)
    third = stage(s.at("layer3"), f.relu(eighth), 2)
    high = stage(s.at("layer3_"), f.relu(eighth))
    down = s.at("down3")
    low = third + down.norm("1", down.conv("0", f.relu(high), 2))
    squeeze = s.at("compression3")
    high = high + resize(squeeze.norm("1", squeeze.conv("0", f.relu(third))), size, corners=False)
    extra = ddr_head(s.at("seghead_extra"), high)
    fourth = stage(s.at("layer4"), f.relu(low), 2)
    high = stage(s.at("layer4_"), f.relu(high))
    down = s.at("down4")
    y = f.relu(down.norm("1", down.conv("0", f.relu(high), 2)))
    low = fourth + down.norm("4", down.conv("3", y, 2))
    squeeze = s.at("compression4")
    high = high + resize(squeeze.norm("1", squeeze.conv("0", f.relu(fourth))), size, corners=False)
    high = bottleneck(s.at("layer5_.0"), f.relu(high), 1)
    low = bottleneck(s.at("layer5.0"), f.relu(low), 2)
    context = resize(dappm(s.at("spp"), low), size, corners=False)
    return [ddr_head(s.at("final_layer"), context + high), extra]


def cbr(s: State, name: str, x: Tensor, stride: int = 1, *, relu: bool = True) -> Tensor:
    y = s.at(name).norm("bn", s.at(name).conv("conv", x, stride))
    return f.relu(y) if relu else y


def separable(s: State, name: str, x: Tensor, stride: int = 1, *, relu: bool = True) -> Tensor:
    return cbr(s.at(name), "point_wise_cbr", s.at(name).conv("conv1", x, stride, groups=x.shape[1]), relu=relu)


def xception_stage(s: State, x: Tensor, blocks: int) -> Tensor:
    for i in range(blocks):
        block, stride = s.at(str(i)), 2 if i == 0 else 1
        y = separable(block, "residual_branch.0", x, stride)
        y = separable(block, "residual_branch.1", y)
        y = separable(block, "residual_branch.2", y, relu=False)
        x = f.relu(y + (separable(block, "proj", x, 2, relu=False) if i == 0 else x))
    return x


def attention_refinement(s: State, x: Tensor) -> Tensor:
    y = cbr(s, "conv_3x3", x)
    return y * torch.sigmoid(cbr(s, "channel_attention.1", y.mean((2, 3), True), relu=False))


def bise_head(s: State, x: Tensor) -> Tensor:
    return s.conv("conv_1x1", cbr(s, "conv_3x3", x))


def bisenet(s: State, x: Tensor) -> list[Tensor]:
    """Main logits at 1/8, then the auxiliary ones at 1/16 and 1/8."""
    path = s.at("spatial_path")
    spatial = cbr(path, "conv_3x3_2", cbr(path, "conv_3x3_1", cbr(path, "conv_7x7", x, 2), 2), 2)
    spatial = cbr(path, "conv_1x1", spatial)
    path = s.at("context_path")
    y = f.max_pool2d(cbr(path, "conv1", x, 2), 3, 2, 1)
    x8 = xception_stage(path.at("layer1"), y, 4)
    x16 = xception_stage(path.at("layer2"), x8, 8)
    x32 = xception_stage(path.at("layer3"), x16, 4)
    overall = resize(cbr(s, "global_context.1", x32.mean((2, 3), True)), size_of(x32), corners=True)
    fm32 = attention_refinement(s.at("arms.0"), x32) + overall
    up16 = cbr(s, "refines.0", resize(fm32, size_of(x16), corners=True))
    fm16 = attention_refinement(s.at("arms.1"), x16) + up16
    up8 = cbr(s, "refines.1", resize(fm16, size_of(x8), corners=True))
    ffm = s.at("ffm")
    fused = cbr(ffm, "conv_1x1", torch.cat([spatial, up8], 1))
    share = f.relu(ffm.conv("channel_attention.1.conv", fused.mean((2, 3), True)))
    fused = fused + fused * torch.sigmoid(ffm.conv("channel_attention.2.conv", share))
    return [bise_head(s.at("heads.2"), fused), bise_head(s.at("heads.0"), up16), bise_head(s.at("heads.1"), up8)]
