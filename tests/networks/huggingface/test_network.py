"""Networks of transformers from folders: real architectures, tiny, with random weights."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import pytest
import torch
from safetensors.torch import load_file, save_file

from gear.contracts.models import Model
from gear.networks.huggingface.labels import match
from gear.networks.huggingface.options import DepthFolderOptions, DetectorFolderOptions, FolderOptions
from gear.networks.huggingface.set_loss import is_hidden
from gear.networks.runtime import seeded
from gear.networks.weights import write
from gear.plugins.models.huggingface import depth, detect2d, semseg
from gear.testing.model_contract import ModelContract
from gear.values.errors import FieldError, GearError
from tests.networks.detector_samples import SMALL, street_samples
from tests.networks.huggingface_networks import (
    conditional_detr,
    deformable_detr,
    depth_anything,
    detr,
    glpn,
    rt_detr,
    saved,
    segformer,
    yolos,
)


class FolderContract(ModelContract):
    network: ClassVar[Any]
    processor: ClassVar[dict[str, Any]] = {}
    extra: ClassVar[dict[str, Any]] = {}
    tolerance = 1e-3
    folder: ClassVar[Path]

    @pytest.fixture(autouse=True)
    def in_a_folder(self, tmp_path: Path) -> None:
        type(self).folder = saved(type(self).network, tmp_path, **self.processor)

    def make(self) -> Model:
        return self.spec.build(self.spec.config(folder=str(self.folder), device="cpu", **self.extra))


class TestSegformer(FolderContract):
    spec = semseg
    network = segformer
    processor: ClassVar[dict[str, Any]] = {"size": {"height": 64, "width": 64}, "resample": 2}

    def test_classes_go_by_name(self) -> None:
        model: Any = self.make()
        assert model.unmatched == ("banana",)
        sample = self.samples("semseg")[0]
        assert set(model.predict(self.views(sample)).flat) <= {7, 8, 26}
        logits = model(self.batch([sample]))["logits"]
        theirs = model.graph(pixel_values=model.preprocess(self.batch([sample]))).logits
        small = theirs[:, [2, 3]].logsumexp(1)
        assert logits.shape == (1, 19, 64, 128) and bool((logits[:, 2] == -50).all())
        torch.testing.assert_close(logits[:, 13].mean(), small.mean(), rtol=1e-3, atol=1e-3)


class TestGlpn(FolderContract):
    spec = depth
    network = glpn
    processor: ClassVar[dict[str, Any]] = {"size_divisor": 32, "resample": 2, "do_rescale": True}


class TestDepthAnything(FolderContract):
    spec = depth
    network = depth_anything
    processor: ClassVar[dict[str, Any]] = {
        "size": {"height": 70, "width": 70}, "keep_aspect_ratio": True, "ensure_multiple_of": 14, "resample": 3
    }  # fmt: skip
    extra: ClassVar[dict[str, Any]] = {"inverse_scale": 0.5, "inverse_shift": 0.02}


class TestYolos(FolderContract):
    spec = detect2d
    network = yolos
    extra: ClassVar[dict[str, Any]] = {"score_threshold": 0.0}
    task_options = SMALL


class TestRtDetr(FolderContract):
    spec = detect2d
    network = rt_detr
    processor: ClassVar[dict[str, Any]] = {"size": {"height": 64, "width": 64}, "do_normalize": False}
    extra: ClassVar[dict[str, Any]] = {"score_threshold": 0.0}
    task_options = SMALL


def test_names_are_matched() -> None:
    known = {"road": 0, "car": 13, "motorcycle": 17, "vegetation": 8}
    names = {0: "Road, route", 1: "auto; car", 2: "minibike", 3: "tree", 4: "cheese", 5: "motorcycle"}
    assert match(names, known) == ({0: 0, 1: 13, 2: 17, 3: 8, 5: 17}, ("cheese",))


def test_a_folder_without_the_head_is_refused_rather_than_given_a_random_one(tmp_path: Path) -> None:
    folder = saved(segformer, tmp_path)
    state = load_file(folder / "model.safetensors")
    save_file(
        {k: v for k, v in state.items() if "decode_head" not in k}, folder / "model.safetensors", {"format": "pt"}
    )
    with pytest.raises(GearError, match="weights of SegformerForSemanticSegmentation are not there, such as decode"):
        semseg.build(FolderOptions(folder=str(folder)))


def test_relative_depth_must_be_made_metres_and_metric_depth_must_not(tmp_path: Path) -> None:
    relative = str(saved(depth_anything, tmp_path / "relative"))
    metric = str(saved(lambda: depth_anything("metric"), tmp_path / "metric"))
    with pytest.raises(GearError, match="set inverse_scale"):
        depth.build(DepthFolderOptions(folder=relative))
    with pytest.raises(GearError, match="leave inverse_scale at 0"):
        depth.build(DepthFolderOptions(folder=metric, inverse_scale=1.0))
    assert depth.build(DepthFolderOptions(folder=metric, device="cpu"))
    with pytest.raises(FieldError):
        DepthFolderOptions(inverse_scale=-1.0)


def test_other_weights_than_the_folders(tmp_path: Path) -> None:
    folder = str(saved(segformer, tmp_path))
    one, two = (semseg.build(FolderOptions(folder=folder, weights="none", seed=s, device="cpu")) for s in (1, 2))
    key = "decode_head.classifier.weight"
    first, other = (model.module().state_dict() for model in (one, two))  # type: ignore[attr-defined]
    assert not torch.equal(first[key], other[key])
    write(tmp_path / "trained.safetensors", first, {})
    options = FolderOptions(folder=folder, weights=str(tmp_path / "trained.safetensors"), device="cpu")
    trained: Any = semseg.build(options)
    assert all(torch.equal(value, first[name]) for name, value in trained.module().state_dict().items())


@pytest.mark.parametrize(("spec", "network"), [(semseg, segformer), (depth, glpn), (detect2d, yolos)])
def test_a_training_can_begin_with_the_folders_own_weights(spec: Any, network: Any, tmp_path: Path) -> None:
    options = spec.config(folder=str(saved(network, tmp_path)), device="cpu")
    own, other = spec.build(options).module().state_dict(), spec.build(replace(options, weights="none"))
    assert any(not torch.equal(value, own[key]) for key, value in other.module().state_dict().items())
    spec.starts["folder"](other)
    assert all(torch.equal(value, own[key]) for key, value in other.module().state_dict().items())


@pytest.mark.parametrize("network", [detr, conditional_detr, deformable_detr, rt_detr, yolos])
def test_a_detectors_losses_run_at_the_precision_that_was_asked_for(network: Any, tmp_path: Path) -> None:
    folder = str(saved(network, tmp_path))
    samples = street_samples(128, 64)
    pictures = {"left": torch.rand(2, 3, 64, 128, generator=torch.Generator().manual_seed(1))}
    found = {}
    for precision, wanted in (("float32", torch.float32), ("bfloat16", torch.bfloat16)):
        model: Any = detect2d.build(DetectorFolderOptions(folder=folder, device="cpu", precision=precision))
        kinds: set[torch.dtype] = set()
        for layer in model.graph.modules():
            if isinstance(layer, torch.nn.Linear):
                layer.register_forward_hook(lambda _layer, _given, made, kinds=kinds: kinds.add(made.dtype))
        found[precision] = model(pictures, samples)["set_loss"]
        assert kinds == {wanted} and found[precision].dtype == torch.float32
    assert 0 < abs(found["bfloat16"] / found["float32"] - 1) < 0.02


@pytest.mark.parametrize("is_whole", [True, False], ids=["all layers", "the last layer"])
@pytest.mark.parametrize("network", [detr, conditional_detr, deformable_detr, rt_detr, yolos])
def test_queries_in_ignored_objects_are_no_background(network: Any, is_whole: bool, tmp_path: Path) -> None:
    folder = saved(network, tmp_path)
    config = folder / "config.json"
    said = json.loads(config.read_text())
    config.write_text(json.dumps({**said, "auxiliary_loss": is_whole and network is not yolos}))
    model: Any = detect2d.build(DetectorFolderOptions(folder=str(folder), device="cpu"))
    sample = street_samples(128, 64)[0]
    things = [replace(thing, category_id=1) for thing in sample.objects if not thing.is_ignored]
    cover = replace(things[0], is_ignored=True, box_px=(0.0, 0.0, 128.0, 64.0))
    foreign = replace(cover, is_ignored=False, category_id=15)  # a bench, which the network has no class for
    for over in (cover, foreign):
        pictures = torch.rand(2, 3, 64, 128, generator=torch.Generator().manual_seed(1)).requires_grad_()
        samples = [replace(sample, objects=(over,)), replace(sample, objects=())]
        loss = model({"left": pictures}, samples)["set_loss"]
        (seen,) = torch.autograd.grad(loss, pictures)
        assert not seen[0].any() and bool(seen[1].any())
    assert model({"left": pictures[:1]}, samples[:1])["set_loss"].item() < 1e-6
    found = model({"left": pictures[:1]}, [replace(sample, objects=(*things, cover))])["set_loss"]
    assert bool(torch.autograd.grad(found, pictures)[0].any()), "objects to be found are learnt"


def test_ignored_objects_leave_enough_queries_beside_noised_ones(tmp_path: Path) -> None:
    folder = saved(rt_detr, tmp_path)
    config = folder / "config.json"
    config.write_text(json.dumps({**json.loads(config.read_text()), "num_denoising": 6}))
    model: Any = detect2d.build(DetectorFolderOptions(folder=str(folder), device="cpu", weights="none"))
    sample = street_samples(128, 64)[0]
    thing = replace(next(thing for thing in sample.objects if not thing.is_ignored), category_id=1)
    cover = replace(thing, is_ignored=True, box_px=(0.0, 0.0, 128.0, 64.0))
    model.graph.train()
    for layer in model.graph.modules():
        layer.train(not isinstance(layer, torch.nn.BatchNorm2d))
    pictures = torch.rand(1, 3, 64, 128, generator=torch.Generator().manual_seed(1)).requires_grad_()
    losses = []
    for objects in ((thing,), (thing, cover)):
        with seeded(1):  # the noise is the same
            losses.append(model({"left": pictures}, [replace(sample, objects=objects)])["set_loss"].item())
    assert losses[1] == pytest.approx(losses[0], rel=0.05)


def test_queries_near_an_object_or_without_others_take_part() -> None:
    queries = torch.tensor([[0.2, 0.2, 0.2, 0.2], [0.25, 0.2, 0.2, 0.2], [0.3, 0.3, 0.6, 0.6], [0.8, 0.8, 0.2, 0.2]])
    labels = {"boxes": queries[:1], "ignored": torch.tensor([[0.25, 0.25, 0.5, 0.5]])}
    assert is_hidden(queries, labels).tolist() == [False, False, True, False]
    assert is_hidden(queries, labels | {"boxes": queries[:0]}).tolist() == [True, True, True, False]
    assert not is_hidden(queries, labels | {"boxes": queries[3:].expand(2, -1)}).any()
    assert not is_hidden(queries, labels | {"ignored": queries[:0]}).any()
