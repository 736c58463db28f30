"""GLPDepth: published names, a second writing of the network, padding, and that it learns."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import torch

from gear.networks.depth.glpn import Glpn, glpn_graph, mirrored
from gear.networks.depth.glpn_official import from_official
from gear.networks.depth.options import GlpnB0Options, GlpnOptions
from gear.networks.weights import build_graph, mismatches, write
from gear.values.errors import FieldError
from tests.networks import glpdepth_reference as reference

SMALL = GlpnOptions(blocks=(1, 2, 1, 1), widths=(8, 16, 40, 64), decoder_width=8, weights="none", device="cpu", seed=3)


def small_state(seed: int = 1) -> dict[str, torch.Tensor]:
    return reference.random_state(reference.shapes(SMALL.blocks, SMALL.widths, SMALL.decoder_width), seed)


def test_every_published_key_has_its_place() -> None:
    stored = json.loads((Path(__file__).parents[1] / "keys" / "glpdepth.json").read_text())
    with torch.device("meta"):
        graph = glpn_graph(GlpnOptions())
        published = {key: torch.empty(shape) for key, shape in stored.items()}
    assert len(stored) == 890 and sum(parameter.numel() for parameter in graph.parameters()) == 61_220_903
    converted = from_official(published)
    assert mismatches(graph.state_dict(), converted) == []
    assert from_official(converted).keys() == converted.keys() == graph.state_dict().keys()


def test_what_is_not_known_stays_and_is_named() -> None:
    state = small_state() | {"encoder.surplus.weight": torch.zeros(1), "epoch": torch.zeros(1)}
    del state["encoder.norm4.bias"]
    (missing, surplus) = mismatches(glpn_graph(SMALL).state_dict(), from_official(state))
    assert "glpn.encoder.layer_norm.3.bias" in missing
    assert "glpn.encoder.surplus.weight" in surplus and "epoch" in surplus


@pytest.mark.parametrize("size", [(64, 96), (32, 64)])
def test_converted_weights_compute_what_the_paper_draws(tmp_path: Path, size: tuple[int, int]) -> None:
    state = small_state()
    path = tmp_path / "converted.safetensors"
    write(path, from_official(state), {})
    options = GlpnOptions(
        blocks=SMALL.blocks, widths=SMALL.widths, decoder_width=8, weights=str(path), device="cpu", max_depth_m=75.5
    )
    network = Glpn(build_graph(lambda: glpn_graph(options), options, "glpdepth"), options)
    pictures = torch.rand((2, 3, *size), generator=torch.Generator().manual_seed(2))
    with torch.no_grad():
        expected = reference.Official(state, SMALL.blocks, 75.5)(pictures)
        depth_m = network({"left": pictures})["depth_m"]
    assert float(expected.std()) > 1
    torch.testing.assert_close(depth_m, expected, atol=2e-3, rtol=0)


def test_odd_sizes_are_mirrored_out_and_cut_back() -> None:
    network = Glpn(build_graph(lambda: glpn_graph(SMALL), SMALL, "glpdepth"), SMALL)
    picture = torch.rand((1, 3, 50, 71), generator=torch.Generator().manual_seed(2))
    whole = mirrored(picture, 32)
    assert whole.shape == (1, 3, 64, 96)
    torch.testing.assert_close(whole[:, :, 14:, 12:83], picture)
    torch.testing.assert_close(whole[:, :, 13, 12:83], picture[:, :, 1])
    torch.testing.assert_close(whole[:, :, 0, 12:83], picture[:, :, 14])
    torch.testing.assert_close(whole[:, :, 14:, 0], picture[..., 12])
    torch.testing.assert_close(whole[:, :, 14:, 83:], picture[..., -14:-1].flip(3))
    with torch.no_grad():
        depth_m = network({"left": picture})["depth_m"]
        torch.testing.assert_close(depth_m, network({"left": whole})["depth_m"][:, 14:, 12:83])
    assert depth_m.shape == (1, 50, 71)


def test_input_scale_changes_what_it_sees_and_not_what_it_gives() -> None:
    pictures = {"left": torch.rand((1, 3, 64, 128), generator=torch.Generator().manual_seed(2))}
    graph = glpn_graph(SMALL)
    seen = []
    graph.register_forward_pre_hook(lambda _graph, inputs: seen.append(inputs[0].shape[2:]))
    with torch.no_grad():
        halved = Glpn(graph, SMALL, input_scale=0.5)(pictures)["depth_m"]
    assert seen == [(32, 64)] and halved.shape == (1, 64, 128)


@pytest.mark.parametrize(("size", "scale", "wanted"), [((64, 128), 0.1, (32, 32)), ((16, 40), 1.0, (32, 64))])
def test_pictures_too_small_to_be_mirrored_are_enlarged(
    size: tuple[int, int], scale: float, wanted: tuple[int, int]
) -> None:
    graph = glpn_graph(SMALL)
    seen = []
    graph.register_forward_pre_hook(lambda _graph, inputs: seen.append(inputs[0].shape[2:]))
    with torch.no_grad():
        depth_m = Glpn(graph, SMALL, input_scale=scale)({"left": torch.rand((1, 3, *size))})["depth_m"]
    assert seen == [wanted] and depth_m.shape == (1, *size)


@pytest.mark.parametrize(
    ("wrong", "field"),
    [
        ({"widths": (32, 63, 160, 256)}, "widths"),
        ({"blocks": (2, 0, 2, 2)}, "blocks"),
        ({"decoder_width": 7}, "decoder_width"),
        ({"max_depth_m": 0.0}, "max_depth_m"),
        ({"input_scale": 0.0}, "input_scale"),
    ],
)
def test_options_that_cannot_be_are_refused(wrong: dict[str, object], field: str) -> None:
    with pytest.raises(FieldError) as caught:
        GlpnB0Options(**wrong)  # type: ignore[arg-type]
    assert caught.value.field == field
