"""Published weights of NanoDet: graph files and checkpoints give the network's own tensors."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import torch
from torch import nn

from gear.networks.detection.nanodet_graph import NanoDetGraph
from gear.networks.detection.nanodet_official import from_published, layers_in_order
from gear.networks.shipped import inspect
from gear.networks.weights import read
from gear.verbs.weights.convert import convert_weights
from tests.networks.graph_models import write_graph_model


def test_every_convolution_has_its_place_in_the_order() -> None:
    graph = NanoDetGraph()
    layers = [name for name, module in graph.named_modules() if isinstance(module, nn.Conv2d)]
    assert sorted(layers_in_order()) == sorted(layers)
    order: list[str] = []
    for name in layers:
        graph.get_submodule(name).register_forward_hook(lambda *_, name=name: order.append(name))
    graph(torch.zeros(1, 3, 64, 64))
    # The head runs after the pyramid; both are listed scale after scale.
    assert order == list(layers_in_order())


def test_a_graph_file_is_converted(tmp_path: Path) -> None:
    state = NanoDetGraph().half().float().state_dict()
    layers = {
        "Call/convolution" + (f"_{number}" if number else ""): (
            state[f"{name}.weight"].numpy(),
            state[f"{name}.bias"].numpy(),
        )
        for number, name in enumerate(layers_in_order())
    }
    path = write_graph_model(tmp_path, layers)
    report = convert_weights("nanodet_coco", path, tmp_path / "net.safetensors")
    converted, _ = read(report.path)
    assert converted.keys() == state.keys()
    assert all(torch.equal(converted[key], state[key]) for key in state)
    assert json.dumps(inspect(report.path).metadata["source"]) == '"net.json"'


def test_a_checkpoint_with_batch_normalisation_is_folded(tmp_path: Path) -> None:
    class Plain(nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.conv = nn.Conv2d(3, 4, 3, bias=False)
            self.bn = nn.BatchNorm2d(4)

    plain = Plain().eval()
    for name in ("weight", "bias", "running_mean", "running_var"):
        nn.init.uniform_(getattr(plain.bn, name), 0.5, 2.0)
    folded = nn.Conv2d(3, 4, 3)
    state = {f"a.{key}": value for key, value in plain.state_dict().items()}
    state["head.gfl_reg.0.weight"] = state["head.distribution_project.project"] = torch.zeros(1)
    converted = from_published(state)
    assert converted.keys() == {"a.conv.weight", "a.conv.bias"}
    folded.load_state_dict({key.removeprefix("a.conv."): value for key, value in converted.items()})
    pictures = torch.rand(1, 3, 8, 8)
    with torch.no_grad():
        torch.testing.assert_close(folded(pictures), plain.bn(plain.conv(pictures)), rtol=1e-4, atol=1e-5)


def published_checkpoint() -> dict[str, Any]:
    """The keys of the authors' file: batch normalisation after every convolution that has an activation."""
    state: dict[str, Any] = {}
    for key, value in NanoDetGraph().state_dict().items():
        is_normalised = re.fullmatch(r"(backbone|head\.cls_convs)\..*", key) is not None
        if is_normalised and key.endswith(".bias"):
            layer = key.removesuffix(".conv.bias")
            state |= {f"{layer}.bn.{name}": torch.ones_like(value) for name in ("weight", "running_var")}
            state |= {f"{layer}.bn.{name}": torch.zeros_like(value) for name in ("bias", "running_mean")}
            state[f"{layer}.bn.num_batches_tracked"] = torch.tensor(7)
        else:
            state[key] = value
    return {"state_dict": {f"model.{key}": value for key, value in state.items()}}


def test_the_authors_checkpoint_is_converted(tmp_path: Path) -> None:
    torch.save(published_checkpoint(), tmp_path / "nanodet_g.pth")
    report = convert_weights("nanodet_coco", tmp_path / "nanodet_g.pth", tmp_path / "net.safetensors")
    assert report.tensors == len(NanoDetGraph().state_dict())
