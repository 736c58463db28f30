"""NanoDet as a gear network: boxes and losses of outputs that are made by hand."""

from __future__ import annotations

from typing import Any

import pytest
import torch

from gear.networks import torchvision_import
from gear.networks.detection.nanodet import CENTRES_PX, LOGITS, SIDES, NanoDetDetector
from gear.networks.detection.nanodet_graph import BINS, NanoDetGraph
from gear.networks.detection.network import PICTURE
from gear.networks.detection.options import OfficialDetectorOptions
from tests.networks.detector_samples import street_samples

torchvision_import.need()

SIZE = (96, 128)
CAR = 2
"""Index of COCO's third category, car."""


@pytest.fixture(scope="module")
def network() -> NanoDetDetector:
    torch.manual_seed(0)
    options = OfficialDetectorOptions(weights="none", device="cpu", min_size_px=SIZE[0])
    return NanoDetDetector(NanoDetGraph(), options)


def silent(network: NanoDetDetector, size: tuple[int, int] = SIZE) -> dict[str, torch.Tensor]:
    """Outputs without any object for one picture."""
    with torch.no_grad():
        outputs = dict(network.run_for_losses({"left": torch.zeros(1, 3, *size)}))
    outputs[LOGITS] = torch.full_like(outputs[LOGITS], -20.0)
    outputs[SIDES] = torch.zeros_like(outputs[SIDES])
    return outputs


def say(outputs: dict[str, torch.Tensor], cell: int, box: list[float], stride: float, label: int) -> None:
    """Makes one cell predict a box (in pixels of the graph's input), with certainty; sides between two bins are
    shared by both.
    """
    outputs[LOGITS][0, cell, label] = 5.0
    x, y = outputs[CENTRES_PX][0, cell].tolist()
    for side, distance in enumerate((x - box[0], y - box[1], box[2] - x, box[3] - y)):
        low, share = divmod(distance / stride, 1.0)
        bins = torch.full((BINS,), -60.0)
        bins[int(low)] = torch.log(torch.tensor(1.0 - share + 1e-12))
        bins[min(int(low) + 1, BINS - 1)] = torch.log(torch.tensor(share + 1e-12))
        outputs[SIDES][0, cell, side] = bins


def test_cells_lie_at_the_centres_of_three_grids(network: NanoDetDetector) -> None:
    centres = silent(network)[CENTRES_PX][0]
    assert centres[0].tolist() == [4.0, 4.0]
    assert centres[1].tolist() == [12.0, 4.0]
    assert centres[12 * 16].tolist() == [8.0, 8.0]
    assert centres[-1].tolist() == [112.0, 80.0]
    assert len(centres) == 12 * 16 + 6 * 8 + 3 * 4


def test_boxes_are_in_pixels_of_the_picture(network: NanoDetDetector) -> None:
    large = (SIZE[0] * 2, SIZE[1] * 2)  # the graph sees it at half its size
    outputs = silent(network, large)
    say(outputs, 5 * 16 + 6, [20.0, 30.0, 70.0, 60.5], 8.0, CAR)
    (found,) = network.predictions(outputs, large)
    assert len(found) == 1
    assert found[0].category_id == 3
    assert found[0].box_px == pytest.approx((40.0, 60.0, 140.0, 121.0), abs=1e-2)
    assert found[0].score == pytest.approx(0.9933, abs=1e-3)


def test_boxes_end_at_the_pictures_border_and_repeat_not(network: NanoDetDetector) -> None:
    outputs = silent(network)
    for cell in (0, 1):
        say(outputs, cell, [-8.0, -8.0, 40.0, 40.0], 8.0, CAR)
    say(outputs, 2, [-8.0, -8.0, 40.0, 40.0], 8.0, 0)
    (found,) = network.predictions(outputs, SIZE)
    assert sorted(each.category_id for each in found) == [1, 3]
    assert all(each.box_px == pytest.approx((0.0, 0.0, 40.0, 40.0), abs=1e-2) for each in found)


def test_the_graph_reads_blue_green_red(network: NanoDetDetector) -> None:
    given: list[torch.Tensor] = []
    hook = network.graph.get_submodule("backbone").register_forward_pre_hook(lambda _, inputs: given.append(inputs[0]))
    red = torch.zeros(1, 3, *SIZE)
    red[:, 0] = 1.0
    with torch.no_grad():
        network.run({"left": red})
    hook.remove()
    assert given[0][0, 2].mean().item() == pytest.approx((255 - 123.675) / 58.395, abs=1e-3)
    assert given[0][0, 0].mean().item() == pytest.approx(-103.53 / 57.375, abs=1e-3)


def test_losses_fall_to_nearly_nothing_where_the_objects_are_found(network: NanoDetDetector) -> None:
    sample = next(s for s in street_samples(SIZE[1], SIZE[0]) if any(not each.is_ignored for each in s.objects))
    size = torch.tensor([SIZE])
    outputs = silent(network) | {PICTURE: size}
    targets = network.targets(sample, SIZE)
    from gear.networks.detection.atss import assigned

    strides = network._strides(SIZE)
    half = strides[:, None] * 4
    centres = outputs[CENTRES_PX][0]
    objects = assigned(targets.boxes, torch.cat((centres - half, centres + half), dim=1), network._counts(SIZE))
    for cell in (objects >= 0).nonzero().flatten().tolist():
        number = int(objects[cell])
        outputs[LOGITS][0, cell, targets.labels[number]] = 5.0
    before = network.losses(outputs, [sample])  # every side five strides away
    for cell in (objects >= 0).nonzero().flatten().tolist():
        number = int(objects[cell])
        say(outputs, cell, targets.boxes[number].tolist(), float(strides[cell]), int(targets.labels[number]))
    after = network.losses(outputs, [sample])
    assert before["giou"] > 1.0
    assert after["giou"] < 0.02
    assert after["quality_focal"] < 0.02


def test_background_inside_ignored_objects_does_not_count(network: NanoDetDetector) -> None:
    sample = street_samples(SIZE[1], SIZE[0])[0]
    ignored = [each for each in sample.objects if each.is_ignored]
    outputs = silent(network)
    quiet = network.losses(outputs, [sample])["quality_focal"]
    inside = network.targets(sample, SIZE).ignored
    assert len(inside) == len([each for each in ignored if each.box_px[0] < each.box_px[2]])
    centres = outputs[CENTRES_PX][0]
    box = max(inside.tolist(), key=lambda each: (each[2] - each[0]) * (each[3] - each[1]))
    covered = ((centres > torch.tensor(box[:2]) + 4) & (centres < torch.tensor(box[2:]) - 4)).all(dim=1)
    covered &= network._strides(SIZE) == 8
    if covered.any():
        outputs[LOGITS][0, covered.nonzero()[0, 0], 0] = 10.0
        assert network.losses(outputs, [sample])["quality_focal"] == pytest.approx(float(quiet))
    far = int((~covered).nonzero()[0, 0])
    outputs[LOGITS][0, far, 70] = 10.0
    assert network.losses(outputs, [sample])["quality_focal"] > quiet + 0.5


def test_losses_have_gradients_to_the_pixels(network: NanoDetDetector) -> None:
    samples: list[Any] = street_samples(SIZE[1], SIZE[0])
    pictures = torch.rand(len(samples), 3, *SIZE, requires_grad=True)
    sum(network.forward({"left": pictures}, samples).values()).backward()  # type: ignore[union-attr]
    assert pictures.grad is not None
    assert float(pictures.grad.abs().max()) > 0
