"""Models put together: what they hold is frozen and hashed, whether they are torch modules themselves or not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
import torch
from torch import nn

from gear.measuring.guarded_model import weights_digest
from gear.plugins.attacks.optimisation.frozen_model import frozen
from gear.plugins.attacks.optimisation.model_group import Cleaned, Defended, Group
from gear.testing.tiny_networks import TinyConfig, TinySegmenter


class Plain:
    """A model that holds a network and is none."""

    def __init__(self) -> None:
        self.network = TinySegmenter(TinyConfig())

    def predict(self, views: Any) -> Any:
        return self.network.predict(views)

    def forward(self, views: Any, targets: Any | None = None) -> Any:
        return self.network.forward(views, targets)

    def taps(self) -> Mapping[str, nn.Module]:
        return {"trunk": self.network.trunk}


class Nothing:
    """A defense that does nothing."""

    def forward(self, views: Any) -> Any:
        return views


@pytest.mark.parametrize(
    "put_together",
    [
        lambda model: Group({"one": model, "two": TinySegmenter(TinyConfig(seed=1))}),
        lambda model: Defended(model, Nothing()),  # type: ignore[arg-type]
        lambda model: Cleaned(model, Nothing(), model, dict),  # type: ignore[arg-type]
    ],
    ids=["group", "defended", "cleaned"],
)
@pytest.mark.parametrize("is_plain", [True, False])
def test_what_is_held_is_frozen_and_hashed(put_together: Callable[[Any], nn.Module], is_plain: bool) -> None:
    model: Any = Plain() if is_plain else TinySegmenter(TinyConfig())
    network = model.network if is_plain else model
    whole = put_together(model)
    before = weights_digest(whole)
    with frozen(whole):
        assert not any(parameter.requires_grad for parameter in network.parameters())
    assert all(parameter.requires_grad for parameter in network.parameters())
    with torch.no_grad():
        next(network.parameters()).add_(1.0)
    assert before is not None and weights_digest(whole) != before


def test_a_defense_without_gradients_is_given_bytes_sample_by_sample() -> None:
    model: Any = TinySegmenter(TinyConfig())
    given = []

    def clean(views: Mapping[str, Any]) -> Mapping[str, Any]:
        given.append(views["left"])
        return {"left": 255 - views["left"]}

    pictures = torch.rand(2, 3, 16, 24, generator=torch.Generator().manual_seed(5)).requires_grad_()
    found = Cleaned(model, Nothing(), model, clean).forward({"left": pictures})["logits"]  # type: ignore[arg-type]
    levels = np.rint(pictures.detach().numpy() * 255).astype(np.uint8)
    assert [one.dtype for one in given] == [np.uint8] * 2
    assert np.array_equal(np.stack(given), levels.transpose(0, 2, 3, 1))
    with torch.no_grad():
        expected = model.forward({"left": torch.from_numpy(255 - levels).float() / 255})["logits"]
    assert torch.allclose(found, expected, atol=1e-5) and not found.requires_grad
