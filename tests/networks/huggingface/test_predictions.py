"""gear's answers against those of transformers' own image processors, before the network and after it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from gear.formats.coco import CATEGORY_NAMES
from gear.networks.huggingface.labels import match
from gear.networks.huggingface.options import DepthFolderOptions, DetectorFolderOptions, FolderOptions
from gear.networks.segmentation.network import LABEL_ID_OF_TRAIN_ID
from gear.plugins.models.huggingface import depth, detect2d, semseg
from gear.values.frames import UInt8Image
from tests.networks import huggingface_networks as networks
from tests.networks.huggingface.test_processor import picture
from tests.networks.huggingface_networks import saved

import transformers  # isort: skip  # after gear.networks.torchvision_import.prepare, which the helpers call

SIZES = [(375, 1242), (256, 512), (333, 250)]

Make = Callable[[], Any]


def shown(size: tuple[int, int]) -> UInt8Image:
    """(H, W, 3)."""
    return np.ascontiguousarray(picture(*size)[0].permute(1, 2, 0).byte().numpy())


def lively(make: Make) -> Make:
    """With other first weights: those of transformers say nearly the same of every picture and every place of it."""

    def drawn() -> Any:
        network = make()
        for weight in network.parameters():
            if weight.dim() > 1:
                torch.nn.init.xavier_uniform_(weight, gain=1.0)
            elif not weight.any():
                torch.nn.init.uniform_(weight, 0, 0.5)
        return network

    return drawn


def processed(name: str, **options: Any) -> dict[str, Any]:
    return {"image_processor_type": f"{name}ImageProcessor", **options}


def theirs(folder: Path, kind: str, size: tuple[int, int]) -> tuple[Any, Any]:
    """The folder's image processor, and what its network says of the picture: in float, as gear has it."""
    processor = transformers.AutoImageProcessor.from_pretrained(folder, local_files_only=True)
    network = getattr(transformers, f"AutoModelFor{kind}").from_pretrained(folder).eval()
    with torch.no_grad():
        return processor, network(pixel_values=processor(images=picture(*size), return_tensors="pt")["pixel_values"])


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize(
    ("make", "processor"),
    [
        (networks.segformer, processed("Segformer", size=128)),
        (networks.upernet, processed("Segformer", size={"height": 96, "width": 128})),
        (networks.beit, processed("Beit", size={"height": 64, "width": 64})),
    ],
)
def test_labels_are_those_of_the_processor(
    make: Make, processor: dict[str, Any], size: tuple[int, int], tmp_path: Path
) -> None:
    folder = saved(lively(make), tmp_path, **processor)
    config = folder / "config.json"  # names of five train ids, so that no class is left out or added to another
    config.write_text(config.read_text().replace('"van"', '"building"').replace('"banana"', '"sky"'))
    model: Any = semseg.build(FolderOptions(folder=str(folder), device="cpu"))
    own, said = theirs(folder, "SemanticSegmentation", size)
    wanted = own.post_process_semantic_segmentation(said, target_sizes=[size])[0].numpy()
    labels = np.array([LABEL_ID_OF_TRAIN_ID[train_id] for train_id in (0, 1, 2, 13, 10)])
    found = model.predict({"left": shown(size)})
    assert found.shape == size and len(np.unique(found)) > 1
    assert (found != labels[wanted]).mean() < 1e-3


SQUARE = {"size": {"height": 126, "width": 126}, "keep_aspect_ratio": True, "ensure_multiple_of": 14}


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize(
    ("make", "processor", "options"),
    [
        (networks.glpn, processed("GLPN"), {}),
        (lambda: networks.depth_anything("metric"), processed("DPT", **SQUARE), {}),
        (networks.depth_anything, processed("DPT", **SQUARE), {"inverse_scale": 0.5, "inverse_shift": 0.1}),
        (networks.dpt, processed("DPT", **SQUARE), {"inverse_scale": 0.5, "inverse_shift": 0.1}),
        (networks.zoedepth, processed("ZoeDepth", size={"height": 96, "width": 128}, ensure_multiple_of=32), {}),
    ],
    ids=["glpn", "depth_anything_metric", "depth_anything", "dpt", "zoedepth"],
)
def test_depth_is_that_of_the_processor(
    make: Make, processor: dict[str, Any], options: dict[str, Any], size: tuple[int, int], tmp_path: Path
) -> None:
    folder = saved(lively(make), tmp_path, **processor)
    model: Any = depth.build(DepthFolderOptions(folder=str(folder), device="cpu", **options))
    own, said = theirs(folder, "DepthEstimation", size)
    sizes = {"source_sizes": [size]} if "ZoeDepth" in type(own).__name__ else {"target_sizes": [size]}
    wanted = own.post_process_depth_estimation(said, **sizes)[0]["predicted_depth"].numpy()
    if options:
        wanted = 1 / np.maximum(0.5 * wanted + 0.1, 1e-3)
    found = model.predict({"left": shown(size)})
    assert found.shape == size and found.std() > 0
    error = np.abs(found / np.maximum(wanted, 1e-3) - 1)
    assert np.quantile(error, 0.999) < 1e-3, "but for where a network of relative depth comes near to infinity"


EDGES = {"shortest_edge": 64, "longest_edge": 160}


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize(
    ("make", "processor"),
    [
        (networks.detr, processed("Detr", size=EDGES)),
        (networks.conditional_detr, processed("ConditionalDetr", size=EDGES)),
        (networks.deformable_detr, processed("DeformableDetr", size=EDGES)),
        (networks.yolos, processed("Yolos", size=64, max_size=160)),
        (networks.rt_detr, processed("RTDetr", size={"height": 64, "width": 96})),
    ],
)
def test_boxes_are_those_of_the_processor(
    make: Make, processor: dict[str, Any], size: tuple[int, int], tmp_path: Path
) -> None:
    folder = saved(lively(make), tmp_path, **processor)
    least = 0.05
    model: Any = detect2d.build(DetectorFolderOptions(folder=str(folder), device="cpu", score_threshold=least))
    assert model.unmatched == ("unicorn",)
    own, said = theirs(folder, "ObjectDetection", size)
    # Those of two families take a hundred rows, whatever the number of queries, unless they are told.
    most = {"top_k": said.logits.shape[1]} if make in (networks.conditional_detr, networks.deformable_detr) else {}
    there = own.post_process_object_detection(said, threshold=least, target_sizes=[size], **most)[0]
    category_of, _ = match(networks.COCO, {name: number for number, name in CATEGORY_NAMES.items()})
    wanted = sorted(
        (category_of[label], score, *np.clip(box, 0, [size[1], size[0]] * 2))
        for label, score, box in zip(*(there[key].tolist() for key in ("labels", "scores", "boxes")), strict=True)
        if label in category_of
    )
    found = sorted((one.category_id, one.score, *one.box_px) for one in model.predict({"left": shown(size)}))
    assert len(found) > 1
    np.testing.assert_allclose(np.array(found), np.array(wanted), rtol=1e-3, atol=2e-3)


@pytest.mark.parametrize("input_size", ["picture", "processor"])
@pytest.mark.parametrize(("make", "spec"), [(networks.glpn, depth), (networks.rt_detr, detect2d)])
def test_pictures_of_any_size_go_through_without_a_processor(
    make: Make, spec: Any, input_size: str, tmp_path: Path
) -> None:
    folder = saved(make, tmp_path)
    model = spec.build(spec.config(folder=str(folder), device="cpu", input_size=input_size))
    model.predict({"left": shown((375, 250))})


@pytest.mark.parametrize("processor", [{}, processed("DPT", size=70), processed("Yolos", size=64)], ids=str)
@pytest.mark.parametrize(
    ("make", "spec", "options"),
    [
        (lambda: networks.depth_anything("metric"), depth, {}),
        (networks.dpt, depth, {"inverse_scale": 0.5, "inverse_shift": 0.1}),
        (networks.zoedepth, depth, {}),
        (networks.yolos, detect2d, {}),
    ],
    ids=["depth_anything", "dpt", "zoedepth", "yolos"],
)
def test_pictures_that_keep_their_size_are_seen_to_their_edges(
    make: Make, spec: Any, options: dict[str, Any], processor: dict[str, Any], tmp_path: Path
) -> None:
    folder = saved(lively(make), tmp_path, **processor)
    model = spec.build(spec.config(folder=str(folder), device="cpu", input_size="picture", **options))
    shown = torch.rand(1, 3, 79, 159, generator=torch.Generator().manual_seed(1)).requires_grad_()
    said = model({"left": shown})
    (seen,) = torch.autograd.grad(sum(each.sum() for each in said.values()), shown)
    assert bool(seen[..., -1, :].any()) and bool(seen[..., -1].any())


def test_pictures_that_are_filled_up_to_whole_patches_are_not_resized(tmp_path: Path) -> None:
    folder = saved(networks.depth_anything, tmp_path, **processed("DPT", do_resize=False, do_pad=True, size_divisor=14))
    model: Any = depth.build(DepthFolderOptions(folder=str(folder), device="cpu", inverse_scale=1.0))
    assert model.processor.target((79, 159)) == (79, 159)
    assert model.preprocess({"left": torch.rand(1, 3, 79, 159)}).shape == (1, 3, 84, 168)
