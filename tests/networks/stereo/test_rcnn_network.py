"""The graph against its official key list and its quirks; decoding against geometry."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from gear.formats.kitti_object import Calibration
from gear.networks.network import as_batch
from gear.networks.runtime import seeded
from gear.networks.stereo.options import LEFT, RIGHT, StereoRcnnOptions
from gear.networks.stereo.rcnn_decode import decode_cars, place_car
from gear.networks.stereo.rcnn_graph import (
    VARIANCES,
    StereoRcnn,
    StereoRcnnShape,
    anchors,
    is_norm,
    pooled,
)
from gear.networks.stereo.rcnn_losses import car_targets, sample_pairs
from gear.networks.stereo.rcnn_network import StereoRcnnNetwork
from gear.networks.stereo.rcnn_official import from_official
from gear.networks.stereo.rcnn_proposals import legacy_nms, propose
from gear.networks.weights import mismatches
from gear.plugins.models.stereo_rcnn import stereo_rcnn
from gear.plugins.tasks.stereo3d import Stereo3dConfig, Stereo3dSample, Stereo3dTask
from gear.testing.synthetic import synthetic_frame
from gear.values.errors import FieldError
from gear.values.geometry import Intrinsics
from tests.networks.stereo.test_rcnn_losses import Sample, car, perfect_regions

TINY = StereoRcnnShape(blocks=(1, 1, 1, 1), width=8, pyramid=16, proposals=16, hidden=32)


def tiny() -> StereoRcnnNetwork:
    options = StereoRcnnOptions(weights="none", device="cpu", short_side_px=96, pre_nms_top_n=200, proposals=12)
    return StereoRcnnNetwork(options, TINY)


def street() -> Stereo3dSample:
    task = Stereo3dTask(Stereo3dConfig(width_px=256, height_px=96))
    return task.ground_truth(*synthetic_frame(task.rig(), index=0, seed=5))


def test_the_keys_are_the_official_ones() -> None:
    """670 entries; the variances of the losses are gear's own, for the authors keep them elsewhere."""
    stored = json.loads((Path(__file__).parents[1] / "keys" / "stereo_rcnn.json").read_text())
    with torch.device("meta"):
        graph = StereoRcnn(StereoRcnnShape())
    shapes = {key: list(tensor.shape) for key, tensor in graph.state_dict().items()}
    assert shapes.pop(VARIANCES) == [6]
    assert shapes == stored and len(stored) == 670
    assert sum(parameter.numel() for parameter in graph.parameters()) == stereo_rcnn.parameters == 105_891_446 + 6


def test_an_official_state_loads_strictly() -> None:
    """As published, and as converted; converting twice changes nothing."""
    with torch.random.fork_rng():
        one, two, three = (StereoRcnn(TINY) for _ in range(3))
    official = {key: tensor for key, tensor in one.state_dict().items() if key != VARIANCES}
    two.load_state_dict(official, strict=True)
    converted = from_official(official)
    assert not mismatches(three.state_dict(), converted)
    three.load_state_dict(converted, strict=True)
    for key, tensor in one.state_dict().items():
        assert torch.equal(two.state_dict()[key], tensor) and torch.equal(three.state_dict()[key], tensor), key
    assert from_official(converted).keys() == converted.keys()


def test_the_stem_and_the_stages_are_caffes() -> None:
    """Pooling without padding that rounds up; the stride in the first convolution of a stage."""
    graph = tiny().graph
    with torch.no_grad():
        assert graph.RCNN_layer0(torch.zeros(1, 3, 75, 143)).shape[-2:] == (19, 36)
    for layer in (graph.RCNN_layer2, graph.RCNN_layer3, graph.RCNN_layer4):
        first = layer[0][0]
        assert first.conv1.stride == (2, 2) and first.conv2.stride == (1, 1)


def test_levels_are_smoothed_before_they_go_down() -> None:
    """With a smoothing of nothing P4 is nothing, and the top does not reach P3; P6 is every second cell of P5."""
    graph = tiny().graph
    picture = torch.rand(1, 3, 96, 128, generator=torch.Generator().manual_seed(0)) * 255
    with torch.no_grad():
        for parameter in graph.RCNN_smooth1.parameters():
            parameter.zero_()
        before = graph.pyramid(picture)
        graph.RCNN_toplayer.weight.mul_(3.0)
        after = graph.pyramid(picture)
    assert not before[2].any() and torch.equal(before[1], after[1]) and not torch.equal(before[3], after[3])
    assert torch.equal(after[4], after[3][:, :, ::2, ::2])


def test_chances_are_paired_as_the_authors_pair_them() -> None:
    """Softmax over channels c and c + 3, of which anchor a reads 2 a + 1."""
    rpn = tiny().graph.RCNN_rpn
    features = torch.rand(1, 16, 2, 3, generator=torch.Generator().manual_seed(1))
    with torch.no_grad():
        logits, chances, codes = rpn([features], [features])
        hidden = torch.relu(rpn.RPN_Conv(features))
        score = rpn.RPN_cls_score(torch.cat([hidden, hidden], dim=1))[0]
    assert logits.shape == (1, 18, 2) and codes.shape == (1, 18, 6)
    for a, (mine, partner) in enumerate(((1, 4), (3, 0), (5, 2))):
        expected = score[mine].exp() / (score[mine].exp() + score[partner].exp())
        assert torch.allclose(chances[0].view(2, 3, 3)[..., a], expected, atol=1e-6)
        assert torch.allclose(logits[0].view(2, 3, 3, 2)[..., a, :], score[[2 * a, 2 * a + 1]].permute(1, 2, 0))


def test_anchors_stand_on_the_corners_of_their_cells() -> None:
    levels = [torch.zeros(1, 1, 4 >> min(i, 2), 8 >> min(i, 2)) for i in range(5)]
    found = anchors(levels)
    assert len(found) == 3 * sum(level[0, 0].numel() for level in levels)
    root = math.sqrt(0.5)
    assert found[0].tolist() == pytest.approx([-16 * root, -16 / root, 16 * root, 16 / root])
    assert found[4].tolist() == pytest.approx([4 - 16, -16, 4 + 16, 16]), "the next anchor to the right, square"
    assert found[-2].tolist() == pytest.approx([64 - 256, -256, 64 + 256, 256])


def test_regions_take_the_level_of_the_natural_logarithm() -> None:
    """A box with a side of 224 is on level 4; one has to be e times as large for 5, not twice."""
    levels = [torch.full((1, 1, 200 // 2**i, 200 // 2**i), float(i)) for i in range(4)]
    side = torch.tensor([60.0, 130.0, 224.0, 300.0, 400.0, 30.0])
    boxes = torch.cat([torch.zeros(6, 2), side[:, None].expand(6, 2) - 1], dim=1)
    assert pooled(levels, boxes, 2, 800)[:, 0, 0, 0].tolist() == [1.0, 1.0, 2.0, 2.0, 3.0, 0.0]


def test_proposals_must_survive_on_both_sides() -> None:
    """Two apart on the left but alike on the right: the surer one alone is proposed."""
    places = torch.tensor([[10.0, 10, 49, 49], [10.0, 10, 49, 49], [100.0, 10, 139, 49]])
    codes = torch.zeros(3, 6)
    codes[1, 0] = 2.0
    left, right = propose(torch.tensor([0.9, 0.8, 0.7]), codes, places, (64, 200), pre_nms_top_n=3, max_pairs=3)
    assert left.tolist() == [[10, 10, 50, 50], [100, 10, 140, 50]] and torch.equal(left, right)
    limited, _ = propose(torch.tensor([0.9, 0.8, 0.95]), codes, places, (64, 200), pre_nms_top_n=3, max_pairs=1)
    assert limited.tolist() == [[100, 10, 140, 50]]


def test_suppression_counts_the_last_pixel() -> None:
    """Overlap 0.5 with it (10 of 20 columns), 0.47 without."""
    boxes = torch.tensor([[0.0, 0, 14, 9], [5.0, 0, 19, 9]])
    assert legacy_nms(boxes, torch.tensor([0.9, 0.8]), 0.49).tolist() == [0]
    assert legacy_nms(boxes, torch.tensor([0.9, 0.8]), 0.51).tolist() == [0, 1]


@pytest.mark.parametrize(("apart_px", "cars"), [(5.4, 1), (5.7, 2)])
def test_cars_are_suppressed_in_pixels_of_the_original_pictures(apart_px: float, cars: int) -> None:
    """Boxes of 10.3 pixels share 0.3 at 5.6 pixels apart; three times as large, with one last pixel, at 5.2."""
    scale = 3.0
    boxes = torch.tensor([[20.0, 20.0, 29.0, 29.0], [20.0 + apart_px, 20.0, 29.0 + apart_px, 29.0]]) * scale
    said = {
        "class_logits": torch.tensor([[0.0, 5.0], [0.0, 4.0]]), "rois_left": boxes, "rois_right": boxes,
        "box_codes": torch.zeros(2, 2, 6), "size_and_direction": torch.zeros(2, 2, 5),
        "keypoint_logits": torch.zeros(2, 4, 28), "border_logits": torch.zeros(2, 2, 28),
    }  # fmt: skip
    assert len(decode_cars(said, scale, (300, 600), 0.05)) == cars


def test_what_a_perfect_network_says_is_placed() -> None:
    """Outputs written from the truth come back as the car, within what 28 columns can say; unaligned."""
    scale = 600 / 370
    thing = car(1.0, 12.0, -0.9)
    cars = car_targets(Sample(objects=(thing,)), scale)
    nothing = torch.zeros(0, 4)
    pairs = sample_pairs(nothing, nothing, cars, torch.Generator().manual_seed(0))
    said = perfect_regions(pairs, cars) | {"rois_left": pairs.left, "rois_right": pairs.right}
    empty = {name: torch.cat([tensor, torch.zeros_like(tensor)]) for name, tensor in said.items()}
    calibration = Calibration(intrinsics=Intrinsics.from_hfov(1224, 370, math.radians(90)), baseline_m=0.54)
    (found,) = decode_cars(empty, scale, (600, 1985), 0.05)
    label = place_car(found, calibration, None)
    assert label is not None and label.type == "Car" and label.occluded == 0
    assert math.dist(label.location_m, thing.box.bottom_m) < 0.35
    assert label.rotation_y_rad == pytest.approx(thing.box.rotation_y_rad, abs=0.06)
    assert (label.width_m, label.height_m, label.length_m) == pytest.approx((1.7, 1.5, 4.2), abs=1e-4)
    assert np.allclose(label.box_px, cars.left[0].numpy() / scale, atol=1.0)


def test_frozen_parts_stay_frozen() -> None:
    network = tiny()
    network.train()
    norms = [module for module in network.graph.modules() if is_norm(module)]
    assert norms and not any(module.training for module in norms)
    before = {key: tensor.clone() for key, tensor in network.graph.state_dict().items() if "running" in key}
    sample = street()
    with torch.random.fork_rng():
        losses = network(as_batch([sample.images], ("left", "right")), [sample])
    torch.stack(list(losses.values())).sum().backward()
    assert all(torch.equal(network.graph.state_dict()[key], tensor) for key, tensor in before.items())
    learning = {name for name, parameter in network.graph.named_parameters() if parameter.grad is not None}
    assert not any(name.startswith(("RCNN_layer0", "RCNN_layer1")) or ".bn" in name for name in learning)
    assert VARIANCES in learning and "kpts_class.weight" in learning and "RCNN_layer2.0.0.conv1.weight" in learning


def test_variances_weigh_the_losses() -> None:
    """L exp(-s) + s, with every s at -1 at first."""
    network, sample = tiny(), street()
    pictures = as_batch([sample.images], ("left", "right"))
    with torch.no_grad():
        first = network(pictures, [sample])
        network.graph.loss_log_variances.fill_(0.0)
        plain = network(pictures, [sample])
    for name, loss in plain.items():
        assert float(first[name]) == pytest.approx(float(loss) * math.e - 1, rel=1e-4, abs=1e-5), name


def test_what_the_losses_look_at_is_drawn_anew_in_training_and_stays_otherwise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    network, sample, seen = tiny(), street(), list[list[float]]()
    pictures = as_batch([sample.images] * 2, (LEFT, RIGHT))

    def remembered(left: Tensor, right: Tensor, cars: Any, draws: torch.Generator) -> Any:
        seen.append(torch.rand(4, generator=draws).tolist())
        return sample_pairs(left, right, cars, draws)

    monkeypatch.setattr("gear.networks.stereo.rcnn_network.sample_pairs", remembered)

    def draws(seed: int) -> list[list[float]]:
        seen.clear()
        with seeded(seed), torch.no_grad():
            network(pictures, [sample, sample])
        return list(seen)

    assert draws(1) == draws(2) and seen[0] == seen[1]
    network.train()
    first, second = draws(1), draws(2)
    assert first == draws(1)
    assert len({tuple(each) for each in first + second}) == 4


def test_losses_are_not_made_of_outputs() -> None:
    with pytest.raises(TypeError, match="forward"):
        tiny().losses({}, [])


def test_pictures_are_enlarged_as_bgr_less_the_mean() -> None:
    network = tiny()
    red = torch.zeros(1, 3, 48, 100)
    red[:, 0] = 1.0
    shown = network._input(red)
    assert shown.shape == (1, 3, 96, 200)
    assert shown[0, :, 5, 5].tolist() == pytest.approx([-102.9801, -115.9465, 255 - 122.7717], abs=1e-3)


@pytest.mark.parametrize("options", [{"short_side_px": 8}, {"proposals": 0}, {"proposals": 10, "pre_nms_top_n": 5}])
def test_options_are_checked(options: dict[str, int]) -> None:
    with pytest.raises(FieldError):
        StereoRcnnOptions(**options)  # type: ignore[arg-type]


@pytest.mark.slow
def test_its_losses_fall() -> None:
    """Forty steps on one pair, without the variances' help, halve what the proposals and the regions are wrong by.

    Gradients are clipped as the recipe clips them: without it one step in a few hundred throws the network far off.
    """
    network, sample = tiny(), street()
    pictures = as_batch([sample.images], ("left", "right"))
    network.graph.loss_log_variances.requires_grad_(False).zero_()
    learnt = [p for p in network.graph.parameters() if p.requires_grad]
    optimiser, longest = torch.optim.Adam(learnt, lr=1e-3), stereo_rcnn.recipe.gradient_norm
    sums = []
    with torch.random.fork_rng():
        torch.manual_seed(0)
        network.train()
        for module in network.modules():
            if isinstance(module, nn.Dropout):
                module.eval()
        for _ in range(40):
            optimiser.zero_grad()
            total = torch.stack(list(network(pictures, [sample]).values())).sum()
            total.backward()
            nn.utils.clip_grad_norm_(learnt, longest)
            optimiser.step()
            sums.append(float(total.detach()))
    assert sums[-1] < 0.5 * sums[0]
