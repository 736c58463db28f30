"""AdaBins: published names, a second writing of what follows the encoder, the encoder against timm, sizes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch
from torch import Tensor
from torch.nn import functional

from gear.networks.depth.adabins import AdaBins
from gear.networks.depth.adabins_graph import AdaBinsGraph, Decoder, Encoder, fitting, patches
from gear.networks.depth.adabins_official import from_official
from gear.networks.depth.options import AdaBinsOptions
from gear.networks.runtime import seeded
from gear.networks.weights import build_graph, mismatches
from gear.values.errors import FieldError
from tests.networks.glpdepth_reference import random_state

SMALL = AdaBinsOptions(
    encoder="tf_efficientnet_b0", features=64, queries=7, bins=16, weights="none", device="cpu", seed=3
)


def test_every_published_key_has_its_place() -> None:
    stored = json.loads((Path(__file__).parents[1] / "keys" / "adabins.json").read_text())
    with torch.device("meta"):
        graph = AdaBinsGraph(AdaBinsOptions())
        published = {key: torch.empty(shape) for key, shape in stored.items()}
    assert len(stored) == 973 and sum(parameter.numel() for parameter in graph.parameters()) == 78_257_328
    assert sum(key.startswith("encoder.original_model.") for key in stored) == 852
    assert mismatches(graph.state_dict(), from_official(published)) == []
    old = {
        key.replace("_layer.conv3x3.", "_layer.embedding_conv.").replace("embedding_convPxP", "embedding_encoder"): one
        for key, one in published.items()
    }
    assert len(old.keys() - published.keys()) == 4
    assert mismatches(graph.state_dict(), old) and from_official(old).keys() == published.keys()


def test_the_encoder_taps_what_timm_computes() -> None:
    with seeded(1):
        encoder = Encoder("tf_efficientnet_b0").eval()
    seen: list[Tensor] = []
    for index in (0, 1, 2, 4):
        encoder.original_model.blocks[index].register_forward_hook(lambda _m, _i, out: seen.append(out.clone()))
    encoder.original_model.conv_head.register_forward_hook(lambda _m, _i, out: seen.append(out.clone()))
    picture = torch.rand((1, 3, 66, 97), generator=torch.Generator().manual_seed(2))
    with torch.no_grad():
        encoder.original_model.forward_features(picture)
        expected, maps = list(seen), encoder(picture)
    assert [one.shape[1] for one in maps] == encoder.widths() == [16, 24, 40, 112, 1280]
    assert [tuple(one.shape[2:]) for one in maps] == [(33, 49), (17, 25), (9, 13), (5, 7), (3, 4)]
    for one, other in zip(maps, expected, strict=True):
        torch.testing.assert_close(one, other)


def decoder_and_bins(
    state: dict[str, Tensor], maps: list[Tensor], queries: int, range_m: tuple[float, float]
) -> Tensor:
    """The paper's decoder, mini-ViT and hybrid regression, as functions of the tensors."""

    def conv(name: str, found: Tensor, padding: int = 0, stride: int = 1) -> Tensor:
        return functional.conv2d(found, state[f"{name}.weight"], state[f"{name}.bias"], stride, padding)

    def linear(name: str, found: Tensor) -> Tensor:
        return functional.linear(found, state[f"{name}.weight"], state[f"{name}.bias"])

    def layer_norm(name: str, found: Tensor) -> Tensor:
        return functional.layer_norm(found, found.shape[-1:], state[f"{name}.weight"], state[f"{name}.bias"])

    found = conv("decoder.conv2", functional.pad(maps[4], (1, 1, 1, 1)))
    for number, beside in enumerate(reversed(maps[:4]), start=1):
        found = functional.interpolate(found, beside.shape[2:], mode="bilinear", align_corners=True)
        found = torch.cat([found, beside], 1)
        for layer in (0, 3):
            name = f"decoder.up{number}._net"
            found = conv(f"{name}.{layer}", found, padding=1)
            statistics = (state[f"{name}.{layer + 1}.{part}"] for part in ("running_mean", "running_var"))
            scaling = (state[f"{name}.{layer + 1}.{part}"] for part in ("weight", "bias"))
            found = functional.leaky_relu(functional.batch_norm(found, *statistics, *scaling), 0.01)
    features = conv("decoder.conv3", found, padding=1)
    layers = "adaptive_bins_layer"
    tokens = conv(f"{layers}.patch_transformer.embedding_convPxP", features, stride=16).flatten(2).transpose(1, 2)
    batch, count, width = tokens.shape
    tokens = tokens + state[f"{layers}.patch_transformer.positional_encodings"][:count]
    for index in range(4):
        name = f"{layers}.patch_transformer.transformer_encoder.layers.{index}"
        joint = functional.linear(
            tokens, state[f"{name}.self_attn.in_proj_weight"], state[f"{name}.self_attn.in_proj_bias"]
        )
        query, key, value = (part.view(batch, count, 4, 32).transpose(1, 2) for part in joint.chunk(3, dim=2))
        weights = (query @ key.transpose(2, 3) / 32**0.5).softmax(3)
        mixed = linear(f"{name}.self_attn.out_proj", (weights @ value).transpose(1, 2).reshape(batch, count, width))
        tokens = layer_norm(f"{name}.norm1", tokens + mixed)
        hidden = linear(f"{name}.linear2", functional.relu(linear(f"{name}.linear1", tokens)))
        tokens = layer_norm(f"{name}.norm2", tokens + hidden)
    hidden = functional.leaky_relu(linear(f"{layers}.regressor.0", tokens[:, 0]), 0.01)
    hidden = functional.leaky_relu(linear(f"{layers}.regressor.2", hidden), 0.01)
    widths = functional.relu(linear(f"{layers}.regressor.4", hidden)) + 0.1
    edges = torch.cat([torch.zeros(batch, 1), (widths / widths.sum(1, keepdim=True)).cumsum(1)], 1)
    edges = range_m[0] + edges * (range_m[1] - range_m[0])
    centres = (edges[:, 1:] + edges[:, :-1]) / 2
    looked = conv(f"{layers}.conv3x3", features, padding=1).flatten(2)
    attention = (tokens[:, 1 : queries + 1] @ looked).unflatten(2, tuple(features.shape[2:]))
    shares = conv("conv_out.0", attention).softmax(1)
    return (shares * centres[:, :, None, None]).sum(1, keepdim=True)


def test_the_graph_computes_what_the_paper_says() -> None:
    graph = AdaBinsGraph(SMALL).eval()
    graph.load_state_dict(random_state({name: tuple(one.shape) for name, one in graph.state_dict().items()}, 1))
    graph.double()  # random weights make sharp attention, which blows up what float32 rounds
    picture = torch.randn((2, 3, 96, 130), generator=torch.Generator().manual_seed(2)).double()
    with torch.no_grad():
        depth_m, centres_m = graph(picture)
        expected = decoder_and_bins(graph.state_dict(), graph.encoder(picture), 7, (1e-3, 80.0))
    assert depth_m.shape == (2, 1, 48, 65) and centres_m.shape == (2, 16)
    assert float(expected.std()) > 1
    torch.testing.assert_close(depth_m.double(), expected, atol=1e-4, rtol=0)
    assert bool((centres_m.diff(dim=1) > 0).all()) and bool((centres_m > 0).all()) and bool((centres_m < 80).all())


def test_the_padded_convolution_keeps_its_two_pixels() -> None:
    decoder = Decoder([16, 24, 40, 112, 1280], 64, 128)
    assert decoder.conv2(torch.zeros(1, 1280, 3, 5)).shape == (1, 64, 5, 7)


@pytest.mark.parametrize(
    ("size", "expected"),
    [
        ((352, 1216), (352, 1216)),
        ((370, 1224), (370, 1224)),
        ((1024, 2048), None),
        ((64, 128), None),
        ((375, 1900), None),
    ],
)
def test_pictures_are_resized_where_patches_do_not_fit(size: tuple[int, int], expected: tuple[int, int] | None) -> None:
    height, width = fitting(*size, min_patches=129)
    assert 129 <= patches(height, width) <= 500
    assert abs(height / width - size[0] / size[1]) < 0.02
    if expected is not None:
        assert (height, width) == expected
    elif patches(*size) > 500:
        assert patches(height + 32, width + 32) > 500
    else:
        assert patches(height - 1, width - 1) < 129


def test_any_size_comes_back_as_it_went_in() -> None:
    network = AdaBins(build_graph(lambda: AdaBinsGraph(SMALL), SMALL, "adabins"), SMALL)
    for size in ((40, 61), (65, 130), (700, 1400)):
        with torch.no_grad():
            outputs = network({"left": torch.rand((1, 3, *size), generator=torch.Generator().manual_seed(2))})
        assert outputs["depth_m"].shape == (1, *size) and outputs["bin_centres_m"].shape == (1, 16)


@pytest.mark.parametrize(
    ("wrong", "field"),
    [
        ({"encoder": "resnet18"}, "encoder"),
        ({"features": 100}, "features"),
        ({"width": 66}, "width"),
        ({"width": 0}, "width"),
        ({"bins": 1}, "bins"),
        ({"queries": 500}, "queries"),
        ({"min_depth_m": 90.0}, "min_depth_m"),
    ],
)
def test_options_that_cannot_be_are_refused(wrong: dict[str, object], field: str) -> None:
    with pytest.raises(FieldError) as caught:
        AdaBinsOptions(**wrong)  # type: ignore[arg-type]
    assert caught.value.field == field
