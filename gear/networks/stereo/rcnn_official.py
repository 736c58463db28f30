"""Completes published weights of Stereo R-CNN to the parameters of `StereoRcnn`."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from gear.networks.stereo.rcnn_graph import FIRST_LOG_VARIANCE, LOSSES, VARIANCES


def from_official(state: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """The tensors of a published checkpoint; learned variances of the losses that are missing get their initial
    values.

    Args:
        state: tensors of the checkpoint by their published names.
    """
    return {VARIANCES: torch.full((len(LOSSES),), FIRST_LOG_VARIANCE), **state}
