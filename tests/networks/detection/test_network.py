"""gear's detectors against torchvision's own: same weights, same pictures, its transform."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from gear.networks import torchvision_import
from gear.networks.detection.fasterrcnn import _without_ignored
from gear.networks.detection.graphs import fasterrcnn_r50_fpn, retinanet_r50_fpn
from gear.networks.detection.network import Targets, share_inside
from gear.networks.detection.options import OfficialDetectorOptions, ReferenceDetectorOptions
from gear.networks.detection.torchvision_official import from_official
from gear.networks.network import as_batch
from gear.plugins.models import fasterrcnn_r50_fpn as fasterrcnn_plugin
from gear.plugins.models import retinanet_r50_fpn as retinanet_plugin
from gear.plugins.models.retinanet_r18_fpn import build_lite0, build_r18, retinanet_r18
from gear.values.errors import FieldError
from tests.networks.detector_samples import street_samples

torchvision_import.need()

from torchvision.models import detection  # noqa: E402
from torchvision.ops import FrozenBatchNorm2d  # noqa: E402

OFFICIAL: dict[str, tuple[Any, Any, Any, int]] = {
    "fasterrcnn_r50_fpn": (fasterrcnn_plugin, fasterrcnn_r50_fpn, detection.fasterrcnn_resnet50_fpn, 41_755_286),
    "retinanet_r50_fpn": (retinanet_plugin, retinanet_r50_fpn, detection.retinanet_resnet50_fpn, 34_014_999),
}
WIDTH_PX, HEIGHT_PX = 150, 92
MIN_PX, MAX_PX = 128, 190
"""The picture becomes 190 x 116, filled up to 192 x 128."""


@pytest.mark.parametrize("name", OFFICIAL)
def test_keys_and_shapes_are_the_published_ones(name: str) -> None:
    stored = json.loads((Path(__file__).parents[1] / "keys" / f"{name}.json").read_text())
    with torch.device("meta"):
        graph = OFFICIAL[name][1](0.05)
    state = graph.state_dict()
    assert {key: list(value.shape) for key, value in state.items()} == stored
    assert sum(parameter.numel() for parameter in graph.parameters()) == OFFICIAL[name][3]
    norms = [module for module in graph.modules() if isinstance(module, FrozenBatchNorm2d)]
    assert len(norms) == 53 and {norm.eps for norm in norms} == {0.0}
    assert not any(isinstance(module, nn.BatchNorm2d) for module in graph.modules())


def old_names(state: dict[str, Tensor]) -> dict[str, Tensor]:
    """As the files of 2019 name them: without blocks, activations counted."""

    def renamed(key: str) -> str:
        key = re.sub(r"(rpn\.head\.conv)\.0\.0\.", r"\1.", key)
        key = re.sub(r"((?:inner|layer)_blocks\.\d)\.0\.", r"\1.", key)
        return re.sub(r"(_head\.conv)\.(\d)\.0\.", lambda found: f"{found[1]}.{2 * int(found[2])}.", key)

    return {renamed(key): value for key, value in state.items()}


@pytest.mark.parametrize("name", OFFICIAL)
def test_files_of_2019_are_read_as_torchvision_reads_them(name: str) -> None:
    stored = json.loads((Path(__file__).parents[1] / "keys" / f"{name}.json").read_text())
    state = {key: torch.full(shape, float(number)) for number, (key, shape) in enumerate(stored.items())}
    old = old_names(state)
    assert len(old.keys() - state.keys()) >= 18
    converted = from_official(old | {"backbone.body.bn1.num_batches_tracked": torch.tensor(3)})
    assert converted.keys() == state.keys()
    assert all(torch.equal(converted[key], state[key]) for key in state)
    assert from_official(converted).keys() == converted.keys()
    with torch.device("meta"):
        theirs = OFFICIAL[name][2](weights=None, weights_backbone=None)
    theirs = theirs.to_empty(device="cpu")
    theirs.load_state_dict(old, strict=False)
    loaded = theirs.state_dict()
    assert all(torch.equal(loaded[key], state[key]) for key in state)


@pytest.fixture(
    scope="module", params=["retinanet_r50_fpn", pytest.param("fasterrcnn_r50_fpn", marks=pytest.mark.slow)]
)
def pair(request: pytest.FixtureRequest) -> tuple[Any, Any]:
    """gear's network and torchvision's, with the same weights, which give a variety of scores."""
    plugin, _, theirs_of, _ = OFFICIAL[request.param]
    options = OfficialDetectorOptions(weights="none", device="cpu", min_size_px=MIN_PX, max_size_px=MAX_PX, seed=4)
    ours = plugin.build(options)
    with torch.random.fork_rng(devices=[]), torch.no_grad():
        torch.manual_seed(1)
        for name, value in ours.graph.state_dict().items():
            if name.endswith("bn3.weight"):
                value.mul_(0.1)  # or else nothing keeps the features of random layers small
            if re.search(r"(cls_logits|cls_score|bbox_reg|bbox_pred|fc\d|_head\.conv\.\d\.0)\.weight", name):
                value.normal_(0, 2.0 / value[0].numel() ** 0.5)
            if name.endswith("classification_head.cls_logits.bias"):
                value.fill_(-3.5)
    theirs = theirs_of(weights=None, weights_backbone=None, min_size=MIN_PX, max_size=MAX_PX).eval()
    missing, surplus = theirs.load_state_dict(ours.graph.state_dict(), strict=False)
    assert not surplus and all(key.endswith("num_batches_tracked") for key in missing)
    for module in theirs.modules():
        if isinstance(module, nn.BatchNorm2d):
            module.eps = 0.0
    return ours, theirs


def test_detections_are_torchvisions(pair: tuple[Any, Any]) -> None:
    ours, theirs = pair
    samples = street_samples(WIDTH_PX, HEIGHT_PX)
    with torch.no_grad():
        wanted = theirs(list(as_batch([sample.images for sample in samples], ["left"])["left"]))
    found = ours.predict_many([sample.images for sample in samples])
    for mine, other in zip(found, wanted, strict=True):
        expected = [
            (label, score, box)
            for label, score, box in zip(*(other[key].tolist() for key in ("labels", "scores", "boxes")), strict=True)
            if ours.categories[label] is not None
        ]
        assert len(mine) == len(expected) > 10
        assert [one.category_id for one in mine] == [label for label, _, _ in expected]
        np.testing.assert_allclose([one.score for one in mine], [score for _, score, _ in expected], atol=1e-4)
        np.testing.assert_allclose([one.box_px for one in mine], [box for _, _, box in expected], atol=0.02)
        edges = np.array([one.box_px for one in mine])
        assert edges.min() >= 0 and edges[:, 2].max() <= WIDTH_PX and edges[:, 3].max() <= HEIGHT_PX
        assert edges[:, 2].max() > MIN_PX * 0.9  # in the picture's pixels, not the graph's


def torchvision_losses(theirs: Any, pictures: Tensor, targets: list[dict[str, Tensor]], seed: int) -> Any:
    """Of its training mode, with the batch normalisation that its published networks have: frozen."""
    theirs.train()
    theirs.transform.eval()
    for module in theirs.modules():
        if isinstance(module, nn.BatchNorm2d):
            module.eval()
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        losses = theirs(list(pictures), targets)
    theirs.eval()
    return losses


def test_losses_and_gradients_are_torchvisions_in_training(pair: tuple[Any, Any]) -> None:
    ours, theirs = pair
    samples = [
        replace(sample, objects=tuple(thing for thing in sample.objects if not thing.is_ignored))
        for sample in street_samples(WIDTH_PX, HEIGHT_PX)
    ]
    targets = [
        {
            "boxes": torch.tensor([thing.box_px for thing in sample.objects]),
            "labels": torch.tensor([thing.category_id for thing in sample.objects]),
        }
        for sample in samples
    ]
    batch = as_batch([sample.images for sample in samples], ["left"])["left"]
    mine, other = batch.clone().requires_grad_(), batch.clone().requires_grad_()
    state = torch.get_rng_state()
    losses = ours({"left": mine}, samples)
    again = ours({"left": mine}, samples)
    assert torch.equal(state, torch.get_rng_state())
    assert all(torch.equal(loss, again[name]) for name, loss in losses.items())
    wanted = torchvision_losses(theirs, other, targets, ours.options.seed)
    assert losses.keys() == wanted.keys()
    for name, loss in losses.items():
        assert loss.item() == pytest.approx(wanted[name].item(), rel=2e-4), name
        assert loss.item() > 1e-4
    gradients = [
        torch.autograd.grad(sum(each.values()), picture)[0].flatten()
        for each, picture in ((losses, mine), (wanted, other))
    ]
    assert float(torch.cosine_similarity(*gradients, dim=0)) > 0.999
    assert not ours.training and not any(module.training for module in ours.modules())


def test_ignored_objects_are_no_background(pair: tuple[Any, Any]) -> None:
    """An ignored object over everything leaves the background's loss to what is outside it: almost nothing."""
    ours, _ = pair
    sample = street_samples(WIDTH_PX, HEIGHT_PX, 1)[0]
    labelled = [thing for thing in sample.objects if not thing.is_ignored]
    cover = replace(labelled[0], is_ignored=True, box_px=(0.0, 0.0, float(WIDTH_PX), HEIGHT_PX * 0.7))
    batch = as_batch([sample.images], ["left"])
    with torch.no_grad():
        plain = ours(batch, [replace(sample, objects=tuple(labelled))])
        covered = ours(batch, [replace(sample, objects=(*labelled, cover))])
        foreign = ours(batch, [replace(sample, objects=(*labelled, replace(cover, is_ignored=False, category_id=12)))])
        nothing = ours(batch, [replace(sample, objects=())])
        only = ours(batch, [replace(sample, objects=(cover,))])
    for name in plain:
        assert torch.isfinite(nothing[name]) and torch.isfinite(only[name])
        assert float(foreign[name]) == float(covered[name])
    changed = "classification" if "classification" in plain else "loss_objectness"
    assert not torch.equal(covered[changed], plain[changed])
    if changed == "classification":
        assert float(covered[changed]) < 0.9 * float(plain[changed])
        assert float(covered["bbox_regression"]) == float(plain["bbox_regression"])


def test_boxes_without_an_area_are_ignored(pair: tuple[Any, Any]) -> None:
    """Annotated by hand they occur; their losses were infinite."""
    ours, _ = pair
    sample = street_samples(WIDTH_PX, HEIGHT_PX, 1)[0]
    labelled = [thing for thing in sample.objects if not thing.is_ignored]
    left, top, right, bottom = labelled[0].box_px
    flat = [replace(labelled[0], box_px=box) for box in ((left, top, left, bottom), (left, top, right, top))]
    batch = as_batch([sample.images], ["left"])
    with torch.no_grad():
        plain = ours(batch, [replace(sample, objects=tuple(labelled))])
        more = ours(batch, [replace(sample, objects=(*labelled, *flat))])
    assert all(torch.isfinite(loss) for loss in more.values())
    assert float(more["bbox_regression" if "bbox_regression" in more else "loss_rpn_box_reg"]) == float(
        plain["bbox_regression" if "bbox_regression" in plain else "loss_rpn_box_reg"]
    )


def test_background_in_ignored_objects_is_never_sampled() -> None:
    nothing = torch.zeros(0, 4)
    boxes = torch.tensor([[0.0, 0, 10, 10], [0, 0, 10, 4], [50, 50, 60, 60]])
    target = Targets(boxes=nothing, labels=torch.zeros(0).long(), ignored=torch.tensor([[0.0, 0, 10, 5]]))
    labels = torch.tensor([0, 0, 0])
    assert _without_ignored([labels], [boxes], [target])[0].tolist() == [-1, -1, 0]
    assert _without_ignored([torch.tensor([2, -1, 0])], [boxes], [target])[0].tolist() == [2, -1, 0]
    assert _without_ignored([labels[:2]], [boxes[:2]], [target])[0].tolist() == [0, 0]


def test_share_inside() -> None:
    boxes = torch.tensor([[0.0, 0, 10, 10], [5, 5, 15, 15], [20, 20, 30, 30]])
    ignored = torch.tensor([[0.0, 0, 10, 5], [0, 0, 10, 10]])
    assert share_inside(boxes, ignored).tolist() == pytest.approx([1.0, 0.25, 0.0])
    assert share_inside(boxes, ignored[:0]).tolist() == [0, 0, 0]


def planted(model: Any, outputs: dict[str, Tensor], picture: int, category: int, anchor: int) -> dict[str, Tensor]:
    """Outputs in which one anchor is sure of a class, and everything else of nothing."""
    logits = torch.full_like(outputs["cls_logits"], -12.0)
    logits[picture, anchor, model.categories.index(category)] = 3.0
    return outputs | {"cls_logits": logits, "bbox_regression": torch.zeros_like(outputs["bbox_regression"])}


@pytest.mark.parametrize(("build", "scale"), [(build_r18, 0.5), (build_r18, 0.73), (build_lite0, 1.0)])
def test_a_sure_anchor_is_a_detection_in_the_pictures_pixels(
    build: Callable[[ReferenceDetectorOptions], Any], scale: float
) -> None:
    model = build(ReferenceDetectorOptions(weights="none", device="cpu", input_scale=scale))
    samples = street_samples(WIDTH_PX, HEIGHT_PX)
    with torch.no_grad():
        outputs = dict(model(as_batch([sample.images for sample in samples], ["left"])))
    anchors = outputs["anchors_px"][1]
    inside = (anchors.min(dim=1).values >= 0) & (anchors[:, 2] <= WIDTH_PX) & (anchors[:, 3] <= HEIGHT_PX)
    chosen = int(inside.nonzero()[-1])
    none, (one,) = model.predictions(planted(model, outputs, 1, 15, chosen), (HEIGHT_PX, WIDTH_PX))
    assert none == () and one.category_id == 15 and one.score == pytest.approx(1 / (1 + np.exp(-3.0)))
    assert one.box_px == pytest.approx(anchors[chosen].tolist(), abs=1e-3)


def test_half_precision_gives_nearly_the_same() -> None:
    batch = as_batch([sample.images for sample in street_samples(WIDTH_PX, HEIGHT_PX)], ["left"])
    with torch.no_grad():
        full, half = (
            build_r18(ReferenceDetectorOptions(weights="none", device="cpu", precision=precision))(batch)
            for precision in ("float32", "bfloat16")
        )
    assert all(tensor.dtype == torch.float32 for tensor in half.values())
    assert torch.equal(full["anchors_px"], half["anchors_px"])
    assert 0 < float((full["cls_logits"] - half["cls_logits"]).abs().max()) < 0.2


def test_anchors_fit_the_objects() -> None:
    """At half size, everything of at least 32 px height at 1333 x 800 has an anchor that it can be learnt with."""
    model = build_r18(ReferenceDetectorOptions(weights="none", device="cpu"))
    with torch.no_grad():
        anchors = model({"left": torch.zeros(1, 3, 800, 1333)})["anchors_px"][0]
    from torchvision.ops import box_iou

    boxes = [
        (600.0 + shift, 300.0, 600.0 + shift + height * ratio, 300.0 + height)
        for height in (32, 45, 64, 100, 180, 300, 480)
        for ratio in (0.3, 0.4, 0.7, 1.0, 1.8, 2.4)
        for shift in (0, 3, 7)
    ]
    best = box_iou(torch.tensor(boxes), anchors).amax(dim=1)
    assert float(best.min()) > 0.4 and float(best.mean()) > 0.6


def test_training_learns() -> None:
    """Fifteen steps on two pictures: the loss falls to a fraction."""
    model = build_r18(ReferenceDetectorOptions(weights="none", device="cpu", input_scale=1.0))
    samples = street_samples(WIDTH_PX, HEIGHT_PX)
    batch = as_batch([sample.images for sample in samples], ["left"])
    optimiser = torch.optim.AdamW(model.parameters(), lr=2e-3)
    model.train()
    history = []
    for _ in range(15):
        loss = sum(model(batch, samples).values())
        optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(model.parameters(), 10.0)
        optimiser.step()
        history.append(loss.item())
    assert np.isfinite(history).all() and history[-1] < 0.8 * history[0]
    model.eval()
    with torch.no_grad():
        assert sum(model(batch, samples).values()).item() < history[0]


@pytest.mark.parametrize("options", [{"input_scale": 0.0}, {"input_scale": 5.0}, {"score_threshold": 1.5}])
def test_options_that_make_no_sense(options: dict[str, float]) -> None:
    with pytest.raises(FieldError):
        retinanet_r18.config(**options)
    with pytest.raises(FieldError):
        OfficialDetectorOptions(max_size_px=0)


def test_a_picture_without_any_proposal_has_no_detections() -> None:
    options = OfficialDetectorOptions(weights="none", device="cpu", min_size_px=64, max_size_px=128)
    model: Any = fasterrcnn_plugin.fasterrcnn.build(options)
    model.graph.rpn.score_thresh = 2.0  # as where a training came apart: no proposal is finite
    (sample,) = street_samples(128, 64, count=1)
    outputs = model.forward(as_batch([sample.images], ("left",)))
    assert not outputs["proposals_px"].any() and len(outputs["class_logits"][0]) == model.graph.rpn.post_nms_top_n()
    assert model.predict(sample.images) == ()
