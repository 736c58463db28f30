"""GLPDepth as its paper draws it, a function of a published file's tensors by their published names.

It shares nothing with transformers' graph, so that the renaming can be held against it.
"""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor
from torch.nn import functional

HEADS = (1, 2, 5, 8)
REDUCTIONS = (8, 4, 2, 1)
KERNELS = (7, 3, 3, 3)
STRIDES = (4, 2, 2, 2)
Shapes = dict[str, tuple[int, ...]]


def shapes(blocks: tuple[int, ...], widths: tuple[int, ...], decoder: int) -> Shapes:
    """Names and shapes of a published file."""
    found: Shapes = {}

    def layer(name: str, *weight: int, bias: bool = True) -> None:
        found[f"{name}.weight"] = weight
        if bias:
            found[f"{name}.bias"] = weight[:1]

    def batch_norm(name: str, width: int) -> None:
        layer(name, width)
        found[f"{name}.running_mean"] = found[f"{name}.running_var"] = (width,)
        found[f"{name}.num_batches_tracked"] = ()

    for stage, (count, width) in enumerate(zip(blocks, widths, strict=True)):
        inputs = 3 if stage == 0 else widths[stage - 1]
        layer(f"encoder.patch_embed{stage + 1}.proj", width, inputs, KERNELS[stage], KERNELS[stage])
        layer(f"encoder.patch_embed{stage + 1}.norm", width)
        for index in range(count):
            block = f"encoder.block{stage + 1}.{index}"
            layer(f"{block}.norm1", width)
            layer(f"{block}.attn.q", width, width)
            layer(f"{block}.attn.kv", 2 * width, width)
            layer(f"{block}.attn.proj", width, width)
            if REDUCTIONS[stage] > 1:
                layer(f"{block}.attn.sr", width, width, REDUCTIONS[stage], REDUCTIONS[stage])
                layer(f"{block}.attn.norm", width)
            layer(f"{block}.norm2", width)
            layer(f"{block}.mlp.fc1", 4 * width, width)
            layer(f"{block}.mlp.dwconv.dwconv", 4 * width, 1, 3, 3)
            layer(f"{block}.mlp.fc2", width, 4 * width)
        layer(f"encoder.norm{stage + 1}", width)
    layer("decoder.bot_conv", decoder, widths[3], 1, 1)
    layer("decoder.skip_conv1", decoder, widths[2], 1, 1)
    layer("decoder.skip_conv2", decoder, widths[1], 1, 1)
    for number in (1, 2, 3):
        layer(f"decoder.fusion{number}.conv1.0", decoder, 2 * decoder, 3, 3)
        batch_norm(f"decoder.fusion{number}.conv1.1", decoder)
        layer(f"decoder.fusion{number}.conv2.0", decoder // 2, decoder, 3, 3)
        batch_norm(f"decoder.fusion{number}.conv2.1", decoder // 2)
        layer(f"decoder.fusion{number}.conv3", 2, decoder // 2, 3, 3)
    layer("last_layer_depth.0", decoder, decoder, 3, 3)
    layer("last_layer_depth.2", 1, decoder, 3, 3)
    return found


def random_state(wanted: Shapes, seed: int) -> dict[str, Tensor]:
    """Numbers that keep signals alive through the network."""
    generator = torch.Generator().manual_seed(seed)
    state = {}
    for name, shape in wanted.items():
        noise = torch.randn(shape, generator=generator)
        if name.endswith("num_batches_tracked"):
            state[name] = torch.tensor(7)
        elif name.endswith("running_var"):
            state[name] = 0.5 + noise.abs()
        elif len(shape) > 1:
            state[name] = noise * (2 / noise[0].numel()) ** 0.5
        else:
            state[name] = (1 if name.endswith("weight") else 0) + 0.2 * noise
    return state


class Official:
    """The network."""

    def __init__(self, state: Mapping[str, Tensor], blocks: tuple[int, ...], max_depth_m: float) -> None:
        self.state, self.blocks, self.max_depth_m = state, blocks, max_depth_m

    def __call__(self, pictures: Tensor) -> Tensor:
        """(B, H, W) metres."""
        maps, found = [], pictures
        for stage in range(4):
            found = self._stage(found, stage)
            maps.append(found)
        one, two, three, four = maps
        found = self._up(self._conv(four, "decoder.bot_conv"))
        found = self._up(self._fuse(self._conv(three, "decoder.skip_conv1"), found, 1))
        found = self._up(self._fuse(self._conv(two, "decoder.skip_conv2"), found, 2))
        found = self._up(self._up(self._fuse(one, found, 3)))
        found = self._conv(functional.relu(self._conv(found, "last_layer_depth.0", 1)), "last_layer_depth.2", 1)
        return torch.sigmoid(found)[:, 0] * self.max_depth_m

    def _stage(self, maps: Tensor, stage: int) -> Tensor:
        embedding = f"encoder.patch_embed{stage + 1}"
        maps = self._conv(maps, f"{embedding}.proj", KERNELS[stage] // 2, STRIDES[stage])
        size = maps.shape[2:]
        tokens = self._layer_norm(maps.flatten(2).transpose(1, 2), f"{embedding}.norm")
        for index in range(self.blocks[stage]):
            block = f"encoder.block{stage + 1}.{index}"
            tokens = tokens + self._attention(self._layer_norm(tokens, f"{block}.norm1"), f"{block}.attn", stage, size)
            hidden = self._linear(self._layer_norm(tokens, f"{block}.norm2"), f"{block}.mlp.fc1")
            mixed = self._conv(self._as_map(hidden, size), f"{block}.mlp.dwconv.dwconv", 1, groups=hidden.shape[2])
            hidden = functional.gelu(mixed.flatten(2).transpose(1, 2))
            tokens = tokens + self._linear(hidden, f"{block}.mlp.fc2")
        return self._as_map(self._layer_norm(tokens, f"encoder.norm{stage + 1}"), size)

    def _attention(self, tokens: Tensor, name: str, stage: int, size: torch.Size) -> Tensor:
        batch, count, width = tokens.shape
        each = width // HEADS[stage]
        query = self._linear(tokens, f"{name}.q").view(batch, count, HEADS[stage], each).transpose(1, 2)
        if REDUCTIONS[stage] > 1:
            reduced = self._conv(self._as_map(tokens, size), f"{name}.sr", 0, REDUCTIONS[stage])
            tokens = self._layer_norm(reduced.flatten(2).transpose(1, 2), f"{name}.norm")
        joint = self._linear(tokens, f"{name}.kv").view(batch, -1, 2, HEADS[stage], each).permute(2, 0, 3, 1, 4)
        found = functional.scaled_dot_product_attention(query, joint[0], joint[1])
        return self._linear(found.transpose(1, 2).reshape(batch, count, width), f"{name}.proj")

    def _fuse(self, near: Tensor, coarse: Tensor, number: int) -> Tensor:
        found = torch.cat([near, coarse], dim=1)
        for name in (f"decoder.fusion{number}.conv1", f"decoder.fusion{number}.conv2"):
            found = functional.relu(self._batch_norm(self._conv(found, f"{name}.0", 1), f"{name}.1"))
        weights = torch.sigmoid(self._conv(found, f"decoder.fusion{number}.conv3", 1))
        return near * weights[:, :1] + coarse * weights[:, 1:]

    def _conv(self, maps: Tensor, name: str, padding: int = 0, stride: int = 1, groups: int = 1) -> Tensor:
        weight, bias = self.state[f"{name}.weight"], self.state[f"{name}.bias"]
        return functional.conv2d(maps, weight, bias, stride, padding, groups=groups)

    def _linear(self, tokens: Tensor, name: str) -> Tensor:
        return functional.linear(tokens, self.state[f"{name}.weight"], self.state[f"{name}.bias"])

    def _layer_norm(self, tokens: Tensor, name: str) -> Tensor:
        return functional.layer_norm(
            tokens, tokens.shape[-1:], self.state[f"{name}.weight"], self.state[f"{name}.bias"]
        )

    def _batch_norm(self, maps: Tensor, name: str) -> Tensor:
        names = ("running_mean", "running_var", "weight", "bias")
        return functional.batch_norm(maps, *(self.state[f"{name}.{part}"] for part in names))

    @staticmethod
    def _as_map(tokens: Tensor, size: torch.Size) -> Tensor:
        return tokens.transpose(1, 2).unflatten(2, tuple(size))

    @staticmethod
    def _up(maps: Tensor) -> Tensor:
        return functional.interpolate(maps, scale_factor=2, mode="bilinear", align_corners=False)
