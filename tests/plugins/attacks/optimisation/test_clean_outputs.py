"""The cache of outputs without a patch."""

from __future__ import annotations

from typing import Any

import torch

from gear.plugins.attacks.optimisation.clean_outputs import CleanOutputs


def test_each_sample_is_computed_once_for_each_model() -> None:
    asked: list[int] = []
    weight = torch.ones(1, requires_grad=True)

    def ask(sample: int) -> torch.Tensor:
        asked.append(sample)
        return weight * sample

    cache, first, second = CleanOutputs(), torch.nn.Identity(), torch.nn.Identity()
    models: list[Any] = [first, second]
    assert cache.of(models[0], [10, 20], [0, 1], ask).flatten().tolist() == [10.0, 20.0]
    found = cache.of(models[0], [20, 30, 10], [1, 2, 0], ask)
    assert found.flatten().tolist() == [20.0, 30.0, 10.0]
    assert not found.requires_grad
    assert asked == [10, 20, 30]
    cache.of(models[1], [10], [0], ask)
    assert asked == [10, 20, 30, 10]
