"""The noise of a stored picture, once more: twins have the same grain, so composed pixels must have it too."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gear.values.optics import CameraEffects
from gear.values.rng import derive_rng
from gear.values.scene import SceneRecord


@dataclass(frozen=True, slots=True, eq=False)
class Grain:
    """Noise of some pixels; see `gear.camera.optics.noisy`.

    Attributes:
        normal: (N, 3) float32 draws.
        shot, read: variance per light, and in the dark; light is 0..1.
    """

    normal: Tensor
    shot: float
    read: float

    def on(self, light: Tensor) -> Tensor:
        """(N, 3) light with noise; differentiable."""
        return light + torch.sqrt((light * self.shot + self.read).clamp_min(1e-12)) * self.normal


def grain_of(
    effects: CameraEffects, record: SceneRecord, view: str, rows: Any, columns: Any, device: torch.device
) -> Grain | None:
    """The noise that a sample's picture was made with, at some pixels; None where it was made without."""
    if effects.shot_noise <= 0 and effects.read_noise <= 0:
        return None
    camera = record.camera(view)
    rng = derive_rng(record.seed, "camera", record.index, view)
    normal = rng.standard_normal((camera.height_px, camera.width_px, 3), dtype=np.float32)[rows, columns]
    return Grain(torch.from_numpy(normal).to(device), (effects.shot_noise / 100) ** 2, (effects.read_noise / 100) ** 2)
