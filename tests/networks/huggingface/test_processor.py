"""gear's image processors against those of transformers: sizes, pixels, and the way back from what the network saw."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor
from torch.nn import functional

from gear.networks import torchvision_import
from gear.networks.huggingface.families import FAMILIES
from gear.networks.huggingface.processor import Processor
from gear.networks.huggingface.processor_file import read_processor
from gear.values.errors import GearError
from gear.values.rng import derive_rng

torchvision_import.prepare()

import transformers  # noqa: E402

SIZES = [(1024, 2048), (375, 1242), (900, 1600), (376, 1241), (402, 1333), (480, 640), (1333, 402), (97, 61)]
"""Of the tasks' pictures, and odd ones."""

WHOLE = {"do_center_crop": False}

SQUARE = {"size": {"height": 518, "width": 518}, "keep_aspect_ratio": True, "ensure_multiple_of": 14}

PROCESSORS: list[tuple[str, dict[str, Any]]] = [
    ("Segformer", {}),
    ("Segformer", {"size": {"shortest_edge": 300}, "resample": 3}),
    ("Segformer", {"do_resize": False, "do_normalize": False}),
    ("Beit", {"do_rescale": False}),
    ("MobileViT", WHOLE),
    ("MobileViT", {**WHOLE, "do_flip_channel_order": False, "do_normalize": True}),
    ("MobileNetV2", {**WHOLE, "rescale_factor": 1 / 128}),
    ("GLPN", {}),
    ("GLPN", {"do_normalize": True, "image_mean": [0.5, 0.4, 0.3], "image_std": [0.2, 0.3, 0.4], "size_divisor": 16}),
    ("DPT", {}),
    ("DPT", SQUARE),
    ("DPT", {"do_pad": True, "size_divisor": 14, "do_resize": False}),
    ("DPT", {"do_pad": True, "size_divisor": 32, "keep_aspect_ratio": True, "size": {"height": 100, "width": 170}}),
    ("ZoeDepth", {}),
    ("ZoeDepth", {"ensure_multiple_of": 32}),
    ("ZoeDepth", {"do_pad": False, "keep_aspect_ratio": False, "resample": 3}),
    ("Detr", {}),
    ("Detr", {"size": 600, "max_size": 1000}),
    ("Detr", {"size": 600}),
    ("ConditionalDetr", {"size": {"height": 300, "width": 500}}),
    ("DeformableDetr", {"image_mean": [0.1, 0.2, 0.3]}),
    ("Yolos", {}),
    ("Yolos", {"size": 512, "max_size": 864}),
    ("RTDetr", {}),
    ("RTDetr", {"size": {"shortest_edge": 480, "longest_edge": 800}, "do_normalize": True}),
]

NAMES = [f"{name}-{'-'.join(options) or 'defaults'}" for name, options in PROCESSORS]


def theirs(name: str, options: dict[str, Any], *, is_pil: bool) -> Any:
    return getattr(transformers, f"{name}ImageProcessor{'Pil' if is_pil else ''}")(**options)


def ours(folder: Path, name: str, options: dict[str, Any]) -> Processor:
    (folder / "preprocessor_config.json").write_text(
        json.dumps({"image_processor_type": f"{name}ImageProcessor", **options})
    )
    return read_processor(folder)


def picture(height: int, width: int) -> Tensor:
    """(1, 3, H, W) whole levels, smooth enough that no interpolation leaves 0..255."""
    coarse = derive_rng(height, "picture").integers(60, 196, (1, 3, height // 24 + 2, width // 24 + 2))
    return functional.interpolate(torch.from_numpy(coarse).float(), (height, width), mode="bilinear").round()


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize(("name", "options"), PROCESSORS, ids=NAMES)
def test_pictures_are_prepared_as_the_image_processor_does(
    name: str, options: dict[str, Any], size: tuple[int, int], tmp_path: Path
) -> None:
    levels = picture(*size)
    wanted = theirs(name, options, is_pil=False)(images=levels, return_tensors="pt")
    found = ours(tmp_path, name, options).apply(levels / 255)
    assert found.shape == wanted["pixel_values"].shape
    assert bool(wanted.get("pixel_mask", torch.ones(1)).all()), "there is padding that the network is told of"
    scale = float(wanted["pixel_values"].abs().max())
    torch.testing.assert_close(found / scale, wanted["pixel_values"] / scale, rtol=0, atol=2e-5)


@pytest.mark.parametrize(("name", "options"), PROCESSORS, ids=NAMES)
def test_pictures_are_prepared_as_pillow_does(name: str, options: dict[str, Any], tmp_path: Path) -> None:
    levels = picture(375, 1242)
    array = levels[0].permute(1, 2, 0).byte().numpy()
    wanted = torch.as_tensor(np.asarray(theirs(name, options, is_pil=True)(images=array)["pixel_values"]))
    found = ours(tmp_path, name, options).apply(levels / 255)
    assert found.shape == wanted.shape
    one_level = float(found.abs().max()) / 60  # theirs rounds to whole levels in between
    assert float((found - wanted).abs().max()) < one_level


@pytest.mark.parametrize("name", FAMILIES)
def test_what_a_file_leaves_out_is_as_their_class_has_it(name: str) -> None:
    kind, facts = theirs(name, {}, is_pil=False), FAMILIES[name].facts({})
    for key, value in facts.items():
        other = getattr(kind, key, None)
        if key == "size" or (other is None and not value):
            continue
        if name == "GLPN" and key in ("image_mean", "image_std"):
            continue  # it has none, and does not normalise
        if name == "MobileViT" and key in ("image_mean", "image_std"):
            continue  # never looked at
        assert (list(value) if isinstance(value, tuple) else value) == (
            list(other) if isinstance(other, list | tuple) else other
        ), key
    if name != "GLPN":
        assert {key: side for key, side in dict(kind.size).items() if side} == facts["size"]
    assert not any(
        getattr(kind, key, None) for key in vars(kind) if key.startswith("do_") and key not in FAMILIES[name].steps()
    )


def test_the_class_goes_by_the_network_where_the_file_names_none(tmp_path: Path) -> None:
    from transformers.models.auto import image_processing_auto

    known = image_processing_auto.IMAGE_PROCESSOR_MAPPING_NAMES
    for name, family in FAMILIES.items():
        for network in family.networks:
            assert known.get(network) in (
                None,
                {"torchvision": f"{name}ImageProcessor", "pil": f"{name}ImageProcessorPil"},
            )
    (tmp_path / "config.json").write_text('{"model_type": "yolos"}')
    (tmp_path / "preprocessor_config.json").write_text("{}")
    assert read_processor(tmp_path).target((375, 1242)) == (400, 1328)
    for ending in ("FeatureExtractor", "ImageProcessorFast", "ImageProcessorPil"):
        said = {"image_processor_type": f"Segformer{ending}", "size": 32}
        (tmp_path / "preprocessor_config.json").write_text(json.dumps(said))
        assert read_processor(tmp_path).target((90, 150)) == (32, 32)


def test_the_long_side_follows_from_the_exact_short_one(tmp_path: Path) -> None:
    assert ours(tmp_path, "Detr", {}).target((375, 1242)) == (402, 1333)


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("options", [{}, {"do_pad": False}, {"ensure_multiple_of": 32}], ids=str)
def test_depth_comes_back_without_the_mirrored_margin(
    options: dict[str, Any], size: tuple[int, int], tmp_path: Path
) -> None:
    processor = ours(tmp_path, "ZoeDepth", options)
    said = processor.apply(picture(*size) / 255)[:, 0]
    wanted = theirs("ZoeDepth", options, is_pil=False).post_process_depth_estimation(
        transformers.modeling_outputs.DepthEstimatorOutput(predicted_depth=said), source_sizes=[size]
    )[0]["predicted_depth"]
    torch.testing.assert_close(processor.restore(said[:, None], size, "bicubic")[0, 0], wanted)


@pytest.mark.parametrize("name", ["DPT", "GLPN"])
def test_depth_comes_back_as_theirs(name: str, tmp_path: Path) -> None:
    processor = ours(tmp_path, name, {})
    said = processor.apply(picture(375, 1242) / 255)[:, 0]
    wanted = theirs(name, {}, is_pil=False).post_process_depth_estimation(
        transformers.modeling_outputs.DepthEstimatorOutput(predicted_depth=said), target_sizes=[(375, 1242)]
    )[0]["predicted_depth"]
    torch.testing.assert_close(processor.restore(said[:, None], (375, 1242), "bicubic")[0, 0], wanted)


PADDED = {"do_pad": True, "size_divisor": 14, "do_normalize": False}


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("DPT", {**PADDED, "do_resize": False}),
        ("DPT", {**PADDED, "size": {"height": 750, "width": 2484}}),
        ("Yolos", {}),
        ("ZoeDepth", {}),
    ],
)
def test_what_was_seen_lands_where_it_was(name: str, options: dict[str, Any], tmp_path: Path) -> None:
    processor = ours(tmp_path, name, {**options, "do_normalize": False})
    shown = picture(375, 1242) / 255
    found = processor.restore(processor.apply(shown), (375, 1242), "bilinear")
    assert found.shape == shown.shape
    assert float((found - shown).abs().max()) < 0.05 and float((found - shown)[..., 1:].abs().mean()) < 2e-3


@pytest.mark.parametrize(
    ("said", "problem"),
    [
        ("{", "not JSON"),
        ("[1]", "a mapping is wanted, got a list"),
        ("\udcff", "cannot be read as JSON"),
        ('{"size": 1' + "0" * 5000 + "}", "cannot be read as JSON"),
        ('{"resample": 5}', r"resample must be nearest \(0\), bilinear \(2\) or bicubic \(3\), got 5"),
        ('{"resample": [2]}', "resample must be"),
        ('{"size": {"max": 3}}', "size must be height and width, or shortest_edge"),
        ('{"size": {"height": "a", "width": 3}}', "size must be"),
        ('{"size": {"height": -4, "width": 3}}', "size must be"),
        ('{"size": {"height": 1.5, "width": 3}}', "size must be"),
        ('{"size": {"height": 1' + "0" * 400 + ', "width": 3}}', "size must be"),
        ('{"size": 0}', "size must be"),
        ('{"size": NaN}', "size must be"),
        ('{"size": {"shortest_edge": 3, "longest_edge": 0}}', "size must be"),
        ('{"image_mean": 3}', "image_mean must be three numbers, got 3"),
        ('{"image_mean": [0, 0]}', "image_mean must be three numbers"),
        ('{"image_mean": [0, 0, NaN]}', "image_mean must be three numbers"),
        ('{"image_mean": ["a", 0, 0]}', "image_mean must be three numbers"),
        ('{"image_std": [0.5, 0, 0.5]}', "image_std must be three numbers above 0"),
        ('{"image_std": [0.5, Infinity, 0.5]}', "image_std must be three numbers above 0"),
        ('{"rescale_factor": "a"}', "rescale_factor must be a number above 0"),
        ('{"rescale_factor": 0}', "rescale_factor must be a number above 0"),
        ('{"do_resize": "yes"}', "do_resize must be true or false"),
        ('{"do_thumbnail": true}', "do_thumbnail is a step that gear does not do"),
        ('{"do_flip_channel_order": true}', "do_flip_channel_order is a step that gear does not do"),
        ('{"do_center_crop": true}', "do_center_crop must be false .or set input_size to picture"),
        ('{"do_pad": true, "pad_size": {"height": 9, "width": 9}}', "pad_size is not supported"),
        ('{"image_processor_type": "DonutImageProcessor"}', "'DonutImageProcessor' is not one that gear repeats"),
        ('{"image_processor_type": [3]}', "is not one that gear repeats"),
        ('{"image_processor_type": "DPTImageProcessor", "do_pad": true}', "size_divisor must be a whole number"),
        ('{"image_processor_type": "DPTImageProcessor", "ensure_multiple_of": 0}', "ensure_multiple_of must be"),
        ('{"image_processor_type": "GLPNImageProcessor", "size_divisor": 0}', "size_divisor must be a whole number"),
        ('{"image_processor_type": "DetrImageProcessor", "size": 3, "max_size": "a"}', "max_size must be"),
    ],
)  # fmt: skip
def test_a_file_that_is_damaged_or_asks_for_more_gets_one_line(said: str, problem: str, tmp_path: Path) -> None:
    path = tmp_path / "preprocessor_config.json"
    (tmp_path / "config.json").write_text('{"model_type": "segformer"}')
    path.write_text(said, errors="surrogateescape")
    with pytest.raises(GearError, match=problem) as caught:
        read_processor(tmp_path)
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value) and len(str(caught.value)) < 600


def test_pictures_that_are_not_resized_are_not_cut_either(tmp_path: Path) -> None:
    ours(tmp_path, "MobileViT", WHOLE)
    (tmp_path / "preprocessor_config.json").write_text('{"image_processor_type": "MobileViTImageProcessor"}')
    assert read_processor(tmp_path, resizes=False).target((375, 1242)) == (375, 1242)
    (tmp_path / "preprocessor_config.json").write_text('{"image_processor_type": "GLPNImageProcessor"}')
    assert read_processor(tmp_path, resizes=False).target((375, 1242)) == (352, 1216)


@pytest.mark.parametrize(
    ("model_type", "wanted"), [("glpn", (352, 1216)), ("rt_detr", (384, 1248)), ("bert", (375, 1242))]
)
@pytest.mark.parametrize("said", [None, '{"do_resize": false}', "{}"])
def test_pictures_that_keep_their_size_fit_the_network(
    model_type: str, wanted: tuple[int, int], said: str | None, tmp_path: Path
) -> None:
    (tmp_path / "config.json").write_text(json.dumps({"model_type": model_type}))
    if said is not None and model_type != "bert":
        (tmp_path / "preprocessor_config.json").write_text(said)
    assert read_processor(tmp_path, resizes=False).target((375, 1242)) == wanted
    if said != "{}":
        assert read_processor(tmp_path).target((375, 1242)) == wanted


def test_without_a_file_nothing_is_resized(tmp_path: Path) -> None:
    assert read_processor(tmp_path) == Processor()
    (tmp_path / "config.json").write_text('{"model_type": "bert"}')
    (tmp_path / "preprocessor_config.json").write_text("{}")
    with pytest.raises(GearError, match="no image_processor_type; write one of SegformerImageProcessor"):
        read_processor(tmp_path)
