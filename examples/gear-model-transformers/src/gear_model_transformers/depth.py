"""Depth networks with metric outputs and with relative inverse depth."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from gear.values.errors import GearError
from torch import Tensor

from gear_model_transformers import DepthConfig
from gear_model_transformers.adapter import FolderModel

NEAREST_M = 1e-3
FURTHEST_M = 1e3


class DepthNetwork(FolderModel):
    """`depth_m` (B, H, W), metres, at the picture's size."""

    def __init__(self, config: DepthConfig) -> None:
        super().__init__(config, "AutoModelForDepthEstimation")
        self.config = config
        own: Any = self.network.config
        says = getattr(own, "depth_estimation_type", "relative" if own.model_type == "dpt" else "metric")
        if (says == "metric") == bool(config.inverse_scale):
            hint = "says metres; leave inverse_scale at 0" if says == "metric" else "says no metres; set inverse_scale"
            raise GearError(f"{config.folder}: {hint}")

    def outputs(self, pictures: Tensor) -> Mapping[str, Tensor]:
        """`depth_m`; the image processor undoes its padding, its assumed field of view and its resizing."""
        said = self.network(**self.seen(pictures))
        undo = self.processor.post_process_depth_estimation
        sizes = [tuple(pictures.shape[2:])] * len(pictures)
        names = {"source_sizes", "target_sizes"} & inspect.signature(undo).parameters.keys()
        depth = torch.stack([one["predicted_depth"] for one in undo(said, **dict.fromkeys(names, sizes))])
        if self.config.inverse_scale:
            depth = 1 / (self.config.inverse_scale * depth + self.config.inverse_shift).clamp(min=1 / FURTHEST_M)
        return {"depth_m": depth.clamp(min=NEAREST_M)}

    def losses(self, pictures: Tensor, targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """Mean absolute difference of logarithms over pixels with ground truth."""
        truth = torch.from_numpy(np.stack([sample.depth_m for sample in targets])).to(pictures.device)
        is_known = torch.isfinite(truth)
        error = (self.outputs(pictures)["depth_m"].log() - truth.where(is_known, 1.0).log()).abs()
        return {"log_l1": (error * is_known).sum() / is_known.sum().clamp_min(1)}

    def answer(self, picture: Tensor) -> npt.NDArray[np.float32]:
        """(H, W) float32 depth in metres of a batch of one."""
        metres: npt.NDArray[np.float32] = self.outputs(picture)["depth_m"][0].cpu().numpy()
        return metres
