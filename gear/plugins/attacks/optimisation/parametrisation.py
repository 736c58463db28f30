"""Parametrisations of textures: the numbers that an attack optimises, and the textures that are computed from them."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import torch
from torch import Tensor


class Parametrisation(Protocol):
    """Protocol of parametrisations. Parameters are float32 tensors whose first axis is the surface."""

    def shape(self, surfaces: int) -> tuple[int, ...]:
        """Returns the shape of the parameters, (surfaces, ...)."""
        ...

    def first(self, surfaces: int, rng: np.random.Generator) -> Tensor:
        """Draws the initial parameters.

        Args:
            surfaces: number of patch surfaces.
            rng: random generator of the draw.
        """
        ...

    def textures(self, parameters: Tensor) -> Tensor:
        """Computes the (S, 3, h, w) textures in 0..1 from the parameters; differentiable.

        Args:
            parameters: parameters of the shape `shape`.
        """
        ...

    def projected(self, parameters: Tensor) -> Tensor:
        """Returns the allowed parameters that replace the given ones after an optimisation step.

        Args:
            parameters: parameters of the shape `shape`.
        """
        ...


class Pixels:
    """The parametrisation of most attacks: the parameters are the textures' values, each free in 0..1.

    Args:
        height_px, width_px: size of the textures.
    """

    def __init__(self, height_px: int, width_px: int) -> None:
        self._size = (height_px, width_px)

    def shape(self, surfaces: int) -> tuple[int, ...]:
        """Returns the shape of the parameters, (surfaces, 3, h, w)."""
        return (surfaces, 3, *self._size)

    def first(self, surfaces: int, rng: np.random.Generator) -> Tensor:
        """Draws every value uniformly in 0..1.

        Args:
            surfaces: number of patch surfaces.
            rng: random generator of the draw.
        """
        return torch.from_numpy(rng.uniform(0, 1, self.shape(surfaces)).astype(np.float32))

    def textures(self, parameters: Tensor) -> Tensor:
        """Returns the parameters, which are the textures.

        Args:
            parameters: (S, 3, h, w) in 0..1.
        """
        return parameters

    def projected(self, parameters: Tensor) -> Tensor:
        """Returns the parameters clipped to 0..1.

        Args:
            parameters: (S, 3, h, w).
        """
        return parameters.clamp(0, 1)
