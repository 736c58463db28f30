"""Copies for predictions: the same to rounding, in step with their network, and out of the way of whoever looks in."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from gear.measuring.plugin_selection import chosen_model
from gear.networks.fused_inference import quick_copy
from gear.networks.network import Network, as_batch
from gear.networks.options import NetworkOptions
from gear.plugins.build import build
from gear.values.rng import derive_rng


class Graph(nn.Module):
    """A pair that can be folded, a convolution that two take from, and a normalisation of no convolution's."""

    def __init__(self) -> None:
        super().__init__()
        self.first, self.first_bn = nn.Conv2d(3, 4, 3, bias=False), nn.BatchNorm2d(4)
        self.twice, self.twice_bn = nn.Conv2d(4, 4, 1), nn.BatchNorm2d(4)
        self.alone = nn.BatchNorm2d(4)
        for norm in (self.first_bn, self.twice_bn, self.alone):
            nn.init.uniform_(norm.weight, 0.5, 2.0)
            nn.init.uniform_(norm.running_mean, -1.0, 1.0)
            nn.init.uniform_(norm.running_var, 0.5, 2.0)

    def forward(self, pictures: Tensor) -> Tensor:
        features = self.first_bn(self.first(pictures)).relu()
        return self.alone(self.twice_bn(self.twice(self.twice(features))).relu())


class Mean(Network):
    has_quick_copy = True

    def __init__(self) -> None:
        with torch.random.fork_rng():
            torch.manual_seed(3)
            graph = Graph()
        super().__init__(graph, NetworkOptions(device="cpu"))

    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        return {"features": self.graph(pictures["left"])}

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[Any]) -> Mapping[str, Tensor]:
        return {"mean": outputs["features"].mean()}

    def predictions(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[Any]:
        return [features.mean(dim=(1, 2)).numpy() for features in outputs["features"]]


VIEWS = {"left": derive_rng(1, "picture").integers(0, 256, (12, 16, 3), dtype=np.uint8)}


def plainly(network: Network) -> Any:
    with torch.no_grad():
        return network(as_batch([VIEWS], ("left",)))["features"][0].mean(dim=(1, 2)).numpy()


def folded(network: Network) -> int:
    """Normalisations fewer than the graph has, in what predicts."""
    quick = network.for_predictions(as_batch([VIEWS], ("left",)))
    return sum(isinstance(m, nn.BatchNorm2d) for m in network.graph.modules()) - sum(
        isinstance(m, nn.BatchNorm2d) for m in quick.graph.modules()
    )


def test_only_what_one_normalisation_takes_from_one_use_is_folded() -> None:
    network = Mean()
    before = copy.deepcopy(network.state_dict())
    quick = quick_copy(network.graph, lambda graph: graph(torch.zeros(1, 3, 12, 16)))
    kinds = {name: type(module) for name, module in quick.named_children()}
    assert kinds["first_bn"] is nn.Identity and kinds["twice_bn"] is kinds["alone"] is nn.BatchNorm2d
    assert quick.first.bias is not None and network.graph.first.bias is None
    assert all(torch.equal(tensor, before[name]) for name, tensor in network.state_dict().items())
    assert not any(module._forward_hooks for module in (*network.graph.modules(), *quick.modules()))


def test_predictions_are_those_of_the_network() -> None:
    network = Mean()
    assert folded(network) == 1
    assert network.predict(VIEWS) == pytest.approx(plainly(network), abs=1e-5)
    assert network.state_dict().keys() == Mean().state_dict().keys(), "the copy is no part of the network"


def test_a_copy_is_used_again_and_again() -> None:
    network, batch = Mean(), as_batch([VIEWS], ("left",))
    assert network.for_predictions(batch).graph is network.for_predictions(batch).graph
    assert np.array_equal(network.predict(VIEWS), network.predict(VIEWS))


@pytest.mark.parametrize("how", ["step", "load", "data", "buffer"])
def test_other_weights_make_another_copy(how: str) -> None:
    network = Mean()
    first, weight = network.predict(VIEWS), network.graph.alone.weight
    with torch.no_grad():
        if how == "step":
            weight.mul_(2)
        elif how == "load":
            network.load_state_dict({name: 2 * value for name, value in network.state_dict().items()})
        elif how == "data":
            weight.data = weight.data * 2
        else:
            network.graph.first_bn.running_mean.add_(1)
    second = network.predict(VIEWS)
    assert not np.allclose(first, second) and second == pytest.approx(plainly(network), abs=1e-4)


def test_a_copied_network_makes_its_own_copy() -> None:
    network = Mean()
    first = network.predict(VIEWS)
    other = copy.deepcopy(network)
    assert np.array_equal(other.predict(VIEWS), first)
    with torch.no_grad():
        other.graph.alone.weight.mul_(2)
    assert not np.allclose(other.predict(VIEWS), first) and np.array_equal(network.predict(VIEWS), first)
    saved = len(pickle.dumps(Mean().graph))
    assert len(pickle.dumps(network.graph)) == saved and len(pickle.dumps(network._quick)) < 200


def test_who_looks_into_the_graph_sees_it_at_work() -> None:
    network = Mean()
    network.predict(VIEWS)
    seen: list[Tensor] = []
    hook = network.graph.first_bn.register_forward_hook(lambda _module, _inputs, output: seen.append(output))
    network.predict(VIEWS)
    hook.remove()
    assert len(seen) == 1 and folded(network) == 1


def test_a_graph_in_training_has_no_copy() -> None:
    network = Mean()
    network.train()
    assert folded(network) == 0


def test_a_network_may_want_none() -> None:
    class Wary(Mean):
        has_quick_copy = False

    assert folded(Wary()) == 0


OURS = (
    pytest.param("adabins", marks=pytest.mark.slow),
    "adabins_lite0",
    "bisenet_x39",
    "ddrnet23_slim",
    "ddrnet23_slim_depth",
    "fasterrcnn_lite0_fpn",
    pytest.param("fasterrcnn_r50_fpn", marks=pytest.mark.slow),
    "glpdepth",
    "glpn_b0",
    "retinanet_lite0_fpn",
    "retinanet_r18_fpn",
    pytest.param("retinanet_r50_fpn", marks=pytest.mark.slow),
    "stereo_centre",
    "stereo_centre_lite0",
)


@pytest.mark.parametrize("name", OURS)
def test_networks_of_gears_say_the_same_with_and_without(name: str) -> None:
    """Of their graphs it holds that nothing but its normalisation takes what a convolution gives."""
    # Without these options detectors enlarge pictures to 800 pixels.
    smaller = ["min_size_px=96", "max_size_px=160"] if name.endswith("_r50_fpn") else []
    chosen = chosen_model(name, ["weights=none", "seed=2", "device=cpu", *smaller])
    network = build(chosen.found, chosen.options)
    assert isinstance(network, Network)
    generator = torch.Generator().manual_seed(5)
    for module in network.graph.modules():
        if isinstance(module, nn.BatchNorm2d) and module.running_mean is not None:
            shape = module.running_mean.shape
            module.running_mean.copy_(0.1 * torch.randn(shape, generator=generator))
            module.weight.data.copy_(0.8 + 0.4 * torch.rand(shape, generator=generator))
    pictures = {view: derive_rng(4, view).integers(0, 256, (96, 160, 3), dtype=np.uint8) for view in ("left", "right")}
    batch = as_batch([pictures], network._views)
    with torch.inference_mode():
        quick = network.for_predictions(batch)
        assert quick.graph is not network.graph
        theirs, ours = quick(batch), network(batch)
    dense = {key for key in ours if not key.startswith(("proposals", "class_logits", "box_regression"))}
    assert dense, "regions of a second stage are chosen, and come in another order where two are as good"
    for key in dense:
        scale = float(ours[key].abs().max()) + 1e-6
        assert float((theirs[key] - ours[key]).abs().max()) < 1e-4 * scale, key


@pytest.mark.parametrize("name", ["retinanet_lite0_fpn", "stereo_centre_lite0"])
def test_normalisations_of_timms_trunks_are_folded_and_their_activations_stay(name: str) -> None:
    chosen = chosen_model(name, ["weights=none", "device=cpu"])
    network = build(chosen.found, chosen.options)
    assert isinstance(network, Network)
    pictures = {view: derive_rng(4, view).integers(0, 256, (96, 160, 3), dtype=np.uint8) for view in ("left", "right")}
    quick = network.for_predictions(as_batch([pictures], network._views))
    left, all_of_them = (
        [type(module).__name__ for module in graph.modules() if isinstance(module, nn.BatchNorm2d)]
        for graph in (quick.graph, network.graph)
    )
    assert "BatchNormAct2d" in all_of_them and "BatchNormAct2d" not in left
    activations = [sum(isinstance(m, nn.ReLU6) for m in graph.modules()) for graph in (quick.graph, network.graph)]
    assert activations[0] == activations[1] > 10
