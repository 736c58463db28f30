"""What a network is shown, what its taps give, and where twins differ."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from gear.plugins.defenses.activations.feature_maps import deepest, feature_maps, spread, tapped
from gear.plugins.defenses.activations.twin_masks import patch_area
from gear.plugins.defenses.activations.zmask_layers import layers_of, network_inputs
from gear.testing.defense_contract import noisy_patch, street_picture
from gear.testing.tiny_networks import TinyConfig, TinySegmenter
from gear.values.errors import GearError


class Pair(nn.Module):
    """Both pictures through one layer, which is rectified in place after its tap."""

    def __init__(self) -> None:
        super().__init__()
        self.first = nn.Conv2d(3, 4, 3, stride=2)
        self.second = nn.Conv2d(4, 2, 3, stride=2)
        self.odd = nn.Flatten()

    def forward(self, views: Mapping[str, Tensor], targets: Any = None) -> Mapping[str, Tensor]:
        both = torch.relu_(self.first(torch.cat([views["left"], views["right"]])))
        return {"out": self.odd(self.second(both.chunk(2)[0]))}

    def taps(self) -> Mapping[str, nn.Module]:
        return {"first": self.first, "second": self.second, "odd": self.odd}

    def predict(self, views: Any) -> Any:
        raise NotImplementedError


def pair() -> dict[str, np.ndarray]:
    return {"left": street_picture(64, 32, 1), "right": street_picture(64, 32, 2)}


def test_maps_are_the_left_picture_s_and_as_the_tap_gave_them() -> None:
    model, views = Pair(), pair()
    picture = torch.from_numpy(views["left"]).permute(2, 0, 1)[None].float() / 255
    with torch.no_grad():
        expected = model.first(picture)[0]
    assert float(expected.min()) < 0  # what the rectifier would have cut
    got = feature_maps(model, views, ["first", "second"])
    assert torch.allclose(got["first"], expected, atol=1e-6)
    assert got["second"].shape == (2, 7, 15)


def test_hooks_are_gone_afterwards() -> None:
    model = Pair()
    feature_maps(model, pair(), ["first"])
    with pytest.raises(GearError):
        feature_maps(model, pair(), ["odd"])
    assert not any(module._forward_hooks for module in model.modules())


@pytest.mark.parametrize(("names", "last"), [(["first"], "first"), (["second", "first"], "second")])
def test_the_network_is_not_run_beyond_the_last_map(names: list[str], last: str) -> None:
    model, run = Pair(), []
    for name, layer in model.taps().items():
        layer.register_forward_hook(lambda *_, name=name: run.append(name))
    batch = {name: torch.rand(1, 3, 32, 64, requires_grad=True) for name in ("left", "right")}
    maps = tapped(model, batch, names)
    assert run[-1] == last
    maps[last].square().sum().backward()
    assert batch["left"].grad is not None and float(batch["left"].grad.abs().sum()) > 0


def test_what_is_no_map_and_what_is_not_there_is_named() -> None:
    with pytest.raises(GearError, match=r"tap 'odd' gives no feature map"):
        feature_maps(Pair(), pair(), ["odd"])
    with pytest.raises(GearError, match=r"no feature maps third; it has first, second, odd"):
        feature_maps(Pair(), pair(), ["third"])


def test_the_deepest_map_is_the_smallest() -> None:
    segmenter = TinySegmenter(TinyConfig())
    assert deepest(segmenter, {"left": street_picture(64, 32, 1)}) == "trunk"


def test_samples_are_spread_over_all_of_them() -> None:
    seen: list[tuple[int, int]] = []
    assert list(spread(range(10), 5, lambda *step: seen.append(step))) == [0, 2, 4, 6, 8]
    assert seen == [(1, 5), (2, 5), (3, 5), (4, 5), (5, 5)]
    assert list(spread(range(3), 5, lambda *step: None)) == [0, 1, 2]


def test_a_mirror_makes_the_right_picture_a_left_one() -> None:
    views = pair()
    plain, mirrored = network_inputs(views)
    assert (plain.camera, plain.is_mirrored, mirrored.camera, mirrored.is_mirrored) == ("left", False, "right", True)
    assert np.array_equal(mirrored.views["left"][:, ::-1], views["right"])
    assert np.array_equal(mirrored.views["right"][:, ::-1], views["left"])
    assert [one.camera for one in network_inputs({"left": views["left"]})] == ["left"]


def test_networks_of_the_paper_get_the_paper_s_layers() -> None:
    class Named:
        def __init__(self, *names: str) -> None:
            self.names = names

        def taps(self) -> dict[str, None]:
            return dict.fromkeys(self.names)

    ddrnet = layers_of(Named("rb1", "rb2", "rbb1", "rbb2"), (), ())  # type: ignore[arg-type]
    assert (ddrnet.shallow, ddrnet.deep) == (("rbb2", "rbb1", "rb1", "rb2"), ("rbb2", "rbb1"))
    other = layers_of(Named("stem", "trunk", "decoder"), (), ())  # type: ignore[arg-type]
    assert (other.shallow, other.deep) == (("stem",), ("stem", "decoder"))
    given = layers_of(Named("stem", "trunk"), ("trunk",), ())  # type: ignore[arg-type]
    assert (given.shallow, given.deep) == (("trunk",), ("stem", "trunk"))
    with pytest.raises(GearError, match="no taps"):
        layers_of(Named(), (), ())  # type: ignore[arg-type]


def test_twins_differ_where_the_patch_is() -> None:
    clean = street_picture(240, 135, 1)
    patched, truth = noisy_patch(clean, 1)
    area = patch_area(clean, patched, 0)
    assert (area & truth).sum() / (area | truth).sum() > 0.97
    assert not patch_area(clean, clean + np.uint8(3), 0).any()  # light on things near a patch


def test_pictures_of_two_scenes_are_no_twins() -> None:
    clean = street_picture(64, 32, 1)
    for other in (255 - clean, clean[:, :-1]):
        with pytest.raises(GearError, match=r"sample 4 .* same seed"):
            patch_area(clean, np.ascontiguousarray(other), 4)
