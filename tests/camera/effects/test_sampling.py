"""Bilinear reads in torch."""

from __future__ import annotations

import numpy as np
import torch

from gear.camera.effects.sampling import read_bilinear


def test_reads_are_bilinear_stop_at_the_border_and_pass_gradients() -> None:
    light = torch.arange(12.0).reshape(1, 1, 3, 4).requires_grad_(True)
    x, y = np.zeros((3, 4)), np.zeros((3, 4))
    x[0], y[0] = (1.5, 9.0, 0.0, -3.0), (0.5, 2.0, 2.0, 0.0)
    found = read_bilinear(light, x, y)
    assert found[0, 0, 0].tolist() == [3.5, 11.0, 8.0, 0.0]
    found[0, 0, 0, 0].backward()
    assert light.grad is not None
    assert light.grad[0, 0].tolist() == [[0.0, 0.25, 0.25, 0.0], [0.0, 0.25, 0.25, 0.0], [0.0] * 4]
