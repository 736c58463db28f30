"""Translates published weights of NanoDet-g: the authors' checkpoints, and graph files made from them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

import torch
from torch import Tensor

from gear.networks.detection.nanodet_graph import STAGES, STRIDES_PX

EPSILON = 1e-5
"""Small number that batch normalisation adds to the variance."""

UNUSED = re.compile(r"head\.(distribution_project|gfl_reg)\.|aux_")
"""Keys of a checkpoint that no prediction uses: constants, and layers of heads that share their convolutions."""

NUMBERED = re.compile(r"(?:.*/)?convolution(?:_(\d+))?\.(weight|bias)")
"""Keys of a graph file: the converter numbers the convolutions in the order in which the network runs them."""


def from_published(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The tensors of gear's NanoDet, from those of a graph file (`gear.networks.graph_model`) or of a checkpoint.

    Batch normalisation of a checkpoint is folded into the convolutions. Other keys are passed on unchanged.

    Args:
        state: tensors of the file by their published names.
    """
    if state and all(NUMBERED.fullmatch(key) for key in state):
        return _from_graph(state)
    return _folded({key: value for key, value in state.items() if not UNUSED.search(key)})


def layers_in_order() -> Iterator[str]:
    """The names of the network's convolutions, in the order in which the network runs them."""
    yield "backbone.stages.0.conv"
    for number, (_, blocks, _) in enumerate(STAGES, start=2):
        stage = f"backbone.stages.{number}"
        yield f"{stage}.in_conv.conv"
        for block in range(blocks):
            yield f"{stage}.res_blocks.{block}.in_conv.conv"
            yield f"{stage}.res_blocks.{block}.mid_conv.conv"
        yield f"{stage}.res_out_conv.conv"
    for scale in range(len(STRIDES_PX)):
        yield f"fpn.lateral_convs.{scale}.conv"
    for scale in range(len(STRIDES_PX)):
        yield f"head.cls_convs.{scale}.0.conv"
        yield f"head.gfl_cls.{scale}"


def _from_graph(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    names = dict(enumerate(layers_in_order()))
    renamed = {}
    for key, value in state.items():
        match = NUMBERED.fullmatch(key)
        assert match is not None
        number = int(match[1] or 0)
        renamed[f"{names.get(number, f'convolution_{number}')}.{match[2]}"] = value
    return renamed


def _folded(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The tensors without batch normalisation: `<layer>.bn` scales and shifts `<layer>.conv`."""
    folded = {key: value for key, value in state.items() if ".bn." not in key}
    for key in state:
        if not key.endswith(".bn.running_var"):
            continue
        layer = key.removesuffix(".bn.running_var")
        mean, variance, scale, shift = (
            state[f"{layer}.bn.{name}"] for name in ("running_mean", "running_var", "weight", "bias")
        )
        factor = scale / torch.sqrt(variance + EPSILON)
        weight = f"{layer}.conv.weight"
        folded[weight] = state[weight] * factor[:, None, None, None]
        folded[f"{layer}.conv.bias"] = shift - mean * factor
    return folded
