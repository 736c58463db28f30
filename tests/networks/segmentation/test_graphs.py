"""The graphs against their official key lists, and against a second writing of the same networks."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import nn

from gear.networks.segmentation.bisenet import BiSeNetX39
from gear.networks.segmentation.bisenet_official import from_official as bisenet_from_official
from gear.networks.segmentation.ddrnet import DDRNet23Slim
from gear.networks.segmentation.ddrnet_official import from_official
from gear.networks.weights import mismatches
from gear.values.rng import derive_rng
from tests.networks import segmentation_reference as reference

Graph = DDRNet23Slim | BiSeNetX39
GRAPHS: dict[str, type[Graph]] = {"ddrnet23_slim": DDRNet23Slim, "bisenet_x39": BiSeNetX39}
REFERENCES: dict[str, Callable[..., list[torch.Tensor]]] = {
    "ddrnet23_slim": reference.ddrnet,
    "bisenet_x39": reference.bisenet,
}


def lively(graph: nn.Module) -> nn.Module:
    """With statistics and biases that are not those of a fresh network, so that none can be left out unnoticed."""
    generator = torch.Generator().manual_seed(int(derive_rng(3, "lively").integers(2**31)))
    with torch.no_grad():
        for name, tensor in [*graph.named_parameters(), *graph.named_buffers()]:
            if tensor.dim() == 1 and name.endswith(("weight", "running_var")):
                tensor.uniform_(0.5, 1.5, generator=generator)
            elif tensor.dim() == 1:
                tensor.normal_(0.0, 0.3, generator=generator)
    return graph.eval()


def pictures(height: int = 64, width: int = 128) -> torch.Tensor:
    return torch.from_numpy(derive_rng(1, "pictures").normal(size=(2, 3, height, width)).astype(np.float32))


@pytest.mark.parametrize(
    ("name", "entries", "parameters", "without"),
    [("ddrnet23_slim", 346, 5_734_342, 5_695_987), ("bisenet_x39", 461, 1_842_289, 1_842_289 - 300_326)],
)
def test_the_keys_are_the_official_ones(name: str, entries: int, parameters: int, without: int) -> None:
    stored: dict[str, list[int]] = json.loads((Path(__file__).parents[1] / "keys" / f"{name}.json").read_text())
    with torch.device("meta"):
        graph = GRAPHS[name](19)
        bare = GRAPHS[name](19, auxiliary=False)
    assert {key: list(tensor.shape) for key, tensor in graph.state_dict().items()} == stored
    assert len(stored) == entries
    assert sum(parameter.numel() for parameter in graph.parameters()) == parameters
    assert sum(parameter.numel() for parameter in bare.parameters()) == without
    assert bare.state_dict().keys() < stored.keys()


@pytest.mark.parametrize("name", GRAPHS)
@pytest.mark.parametrize("size", [(64, 128), (72, 120)])
def test_the_graph_computes_what_its_description_says(name: str, size: tuple[int, int]) -> None:
    graph = lively(GRAPHS[name](19))
    used: set[str] = set()
    with torch.no_grad():
        ours = graph(pictures(*size), auxiliary=True)
        theirs = REFERENCES[name](reference.State(graph.state_dict(), used), pictures(*size))
    assert used == {key for key in graph.state_dict() if not key.endswith("num_batches_tracked")}
    for one, other in zip(ours, theirs, strict=True):
        assert one.shape == other.shape
        assert float(other.std()) > 0.01
        torch.testing.assert_close(one, other, rtol=1e-4, atol=1e-4 * float(other.abs().max()))


@pytest.mark.parametrize("name", GRAPHS)
def test_the_auxiliary_heads_change_nothing(name: str) -> None:
    graph = lively(GRAPHS[name](19))
    bare = GRAPHS[name](19, auxiliary=False).eval()
    bare.load_state_dict({key: value for key, value in graph.state_dict().items() if key in bare.state_dict()})
    with torch.no_grad():
        (alone,) = bare(pictures(), auxiliary=True)
        (main,) = graph(pictures())
    assert torch.equal(alone, main)


@pytest.mark.parametrize("name", GRAPHS)
def test_training_leaves_a_gradient_everywhere(name: str) -> None:
    graph = GRAPHS[name](19).train()
    torch.stack([logits.square().mean() for logits in graph(pictures(), auxiliary=True)]).sum().backward()
    idle = [key for key, parameter in graph.named_parameters() if parameter.grad is None]
    assert idle == []


def test_an_official_ddrnet_file_fits() -> None:
    own = DDRNet23Slim(19).state_dict()
    wrapped: dict[str, Any] = {f"model.{key}": value for key, value in own.items()}
    wrapped["loss.criterion.weight"] = torch.ones(19)
    converted = from_official(wrapped)
    assert converted.keys() == own.keys()
    assert mismatches(own, converted) == []
    assert from_official(converted).keys() == own.keys()


def test_an_official_bisenet_file_fits() -> None:
    own = BiSeNetX39(19).state_dict()
    old = {key: value for key, value in own.items() if not key.endswith("num_batches_tracked")}
    converted = bisenet_from_official(old | {"ohem_criterion.criterion.weight": torch.ones(19)})
    assert mismatches(own, converted) == []
    del converted["ffm.channel_attention.2.conv.weight"]
    assert "ffm.channel_attention.2.conv.weight" in mismatches(own, converted)[0]
