"""Folders that are damaged, of another kind, or that bring code: one line each, and nothing is run."""

from __future__ import annotations

import builtins
import json
import pickle
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from gear.networks.huggingface.options import DepthFolderOptions, DetectorFolderOptions, FolderOptions
from gear.plugins.models.huggingface import depth, detect2d, semseg
from gear.values.errors import GearError
from tests.networks.huggingface_networks import (
    conditional_detr,
    deformable_detr,
    depth_anything,
    detr,
    glpn,
    saved,
    segformer,
    yolos,
)

import transformers  # isort: skip  # after gear.networks.torchvision_import.prepare, which the helpers call

CLASSIFIER = "decode_head.classifier.weight"


def refused(folder: Path, **options: Any) -> str:
    with pytest.raises(GearError) as caught:
        semseg.build(FolderOptions(folder=str(folder), device="cpu", **options))
    return str(caught.value)


def changed(**facts: Any) -> Callable[[Path], object]:
    """Writes other values into config.json; `None` takes one out."""

    def change(folder: Path) -> None:
        path = folder / "config.json"
        said = {**json.loads(path.read_text()), **facts}
        path.write_text(json.dumps({key: value for key, value in said.items() if value is not None}))

    return change


def written(name: str, content: bytes) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_bytes(content)


def with_weights(change: Callable[[dict[str, torch.Tensor]], object]) -> Callable[[Path], object]:
    def rewrite(folder: Path) -> None:
        state = load_file(folder / "model.safetensors")
        change(state)
        save_file(state, folder / "model.safetensors", {"format": "pt"})

    return rewrite


def truncated(folder: Path) -> None:
    path = folder / "model.safetensors"
    path.write_bytes(path.read_bytes()[:-100])


DAMAGED: dict[str, tuple[Callable[[Path], object], str]] = {
    "config not JSON": (written("config.json", b"{"), "config.json:1: not JSON"),
    "config not text": (written("config.json", b"\xff\xfe\x00"), "config.json: cannot be read as JSON"),
    "config empty": (written("config.json", b""), "config.json:1: not JSON"),
    "config a list": (written("config.json", b"[1]"), "config.json: a mapping is wanted, got a list"),
    "config a number": (written("config.json", b"3"), "config.json: a mapping is wanted, got a int"),
    "config a mapping of nothing": (written("config.json", b"{}"), "no network for SemanticSegmentation"),
    "deep": (written("config.json", b"[" * 100_000), "config.json: cannot be read as JSON"),
    "no model_type": (changed(model_type=None), "no network for SemanticSegmentation"),
    "unknown model_type": (changed(model_type="segfrmr"), "segfrmr"),
    "model_type a list": (changed(model_type=[1]), "no network for SemanticSegmentation"),
    "sizes missing": (changed(hidden_sizes=None), "do not fit config.json"),
    "sizes negative": (changed(hidden_sizes=[-8, 8, 16, 16]), "no network for SemanticSegmentation"),
    "sizes nought": (changed(num_attention_heads=[0, 1, 2, 2]), "no network for SemanticSegmentation"),
    "sizes words": (changed(hidden_sizes="wide"), "hidden_sizes"),
    "too few sizes": (changed(hidden_sizes=[8]), "no network for SemanticSegmentation"),
    "other sizes": (changed(decoder_hidden_size=24), r"do not fit config.json, such as decode_head\.\S+: "),
    "activation unknown": (changed(hidden_act="rely"), "no network for SemanticSegmentation.*rely"),
    "labels a list": (changed(id2label=["road"]), "no network for SemanticSegmentation"),
    "labels not numbered": (changed(id2label={"a": "road"}), "no network for SemanticSegmentation"),
    "labels not from 0": (changed(id2label={str(i): "road" for i in range(1, 6)}), "id2label must be names by number"),
    "labels not words": (changed(id2label=dict.fromkeys("01234", 3)), "id2label must be names by number"),
    "processor not JSON": (written("preprocessor_config.json", b"{'a': 1}"), "preprocessor_config.json:1: not JSON"),
    "processor a list": (written("preprocessor_config.json", b"[1]"), "preprocessor_config.json: a mapping is wanted"),
    "processor size": (written("preprocessor_config.json", b'{"size": -3}'), "preprocessor_config.json: size must be"),
    "weights truncated": (truncated, "no network for SemanticSegmentation.*SafetensorError"),
    "weights no safetensors": (written("model.safetensors", b"half"), "no network for SemanticSegmentation"),
    "weights empty": (written("model.safetensors", b""), "no network for SemanticSegmentation"),
    "weights wrong shape": (
        with_weights(lambda state: state.update({CLASSIFIER: torch.zeros(3, 16, 1, 1)})),
        r"1 weights do not fit config.json, such as decode_head.classifier.weight: \(3, 16, 1, 1\), not \(5, 1",
    ),
    "weights missing": (with_weights(lambda state: state.pop(CLASSIFIER)), "1 weights of SegformerForSem.* not there"),
    "weights NaN": (
        with_weights(lambda state: state[CLASSIFIER].view(-1)[3:4].fill_(torch.nan)),
        "decode_head.classifier.weight holds NaN or infinity",
    ),
    "weights infinite": (
        with_weights(lambda state: state[CLASSIFIER].view(-1)[3:4].fill_(torch.inf)),
        "decode_head.classifier.weight holds NaN or infinity",
    ),
    "weights not there": (lambda folder: (folder / "model.safetensors").unlink(), "there is no model.safetensors"),
}  # fmt: skip


@pytest.mark.parametrize("name", DAMAGED)
def test_a_damaged_folder_gets_one_line_that_names_it(
    name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    damage, problem = DAMAGED[name]
    folder = saved(segformer, tmp_path)
    damage(folder)
    capfd.readouterr()
    message = refused(folder)
    with pytest.raises(GearError, match=problem):
        raise GearError(message)
    assert message.startswith(str(folder)) and "\n" not in message and len(message) < 500 + len(str(folder))
    assert capfd.readouterr() == ("", ""), "transformers printed a table beside the line"


def test_a_damaged_config_gets_one_line_without_weights_too(tmp_path: Path) -> None:
    changed(hidden_sizes="wide")(saved(segformer, tmp_path))
    assert "hidden_sizes" in refused(tmp_path, weights="none")


class _Wants:
    """A pickle of this writes a file when it is opened."""

    def __init__(self, marker: Path) -> None:
        self.marker = marker

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.marker,)


@pytest.mark.parametrize("is_listed", [False, True])
def test_a_pickle_is_not_opened(tmp_path: Path, is_listed: bool) -> None:
    folder, marker = saved(segformer, tmp_path / "folder"), tmp_path / "ran"
    (folder / "pytorch_model.bin").write_bytes(pickle.dumps(_Wants(marker)))
    (folder / "model.safetensors").unlink()
    if is_listed:
        save_file({"a": torch.zeros(1)}, folder / "model-1.safetensors")
        listed = {"metadata": {}, "weight_map": {CLASSIFIER: "pytorch_model.bin"}}
        (folder / "model.safetensors.index.json").write_text(json.dumps(listed))
    message = refused(folder)
    assert "save it again with save_pretrained" in message and str(folder) in message and "\n" not in message
    assert not marker.exists()


CODE = """
from pathlib import Path
Path({marker!r}).touch()
from transformers import PretrainedConfig, PreTrainedModel
class OwnConfig(PretrainedConfig):
    model_type = "own"
class OwnModel(PreTrainedModel):
    config_class = OwnConfig
"""


@pytest.mark.parametrize("model_type", ["own", "bert"])
@pytest.mark.parametrize("weights", ["folder", "none"])
def test_a_folders_own_code_is_never_run(
    tmp_path: Path, model_type: str, weights: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def asked(prompt: str = "") -> str:
        raise AssertionError(f"transformers asked: {prompt}")

    monkeypatch.setattr(builtins, "input", asked)
    folder, marker = saved(segformer, tmp_path / "folder"), tmp_path / "ran"
    (folder / "modeling_own.py").write_text(CODE.format(marker=str(marker)))
    classes = {"AutoModelForSemanticSegmentation": "modeling_own.OwnModel"}
    if model_type == "own":
        classes["AutoConfig"] = "modeling_own.OwnConfig"
    (folder / "config.json").write_text(json.dumps({"model_type": model_type, "auto_map": classes}))
    assert refused(folder, weights=weights) == (
        f"{folder}: its network is code of the folder's own (auto_map in config.json), which gear never runs; save a "
        "network that transformers itself has, or write an adapter (docs/how-to/write-a-model.md)"
    )
    assert not marker.exists()


def test_code_beside_a_network_that_transformers_has_is_left_alone(tmp_path: Path) -> None:
    folder, marker = saved(segformer, tmp_path / "folder"), tmp_path / "ran"
    (folder / "modeling_own.py").write_text(CODE.format(marker=str(marker)))
    changed(auto_map={"AutoModelForSemanticSegmentation": "modeling_own.OwnModel"})(folder)
    processor = {
        "image_processor_type": "SegformerImageProcessor",
        "auto_map": {"AutoImageProcessor": "modeling_own.A"},
    }
    (folder / "preprocessor_config.json").write_text(json.dumps(processor))
    assert semseg.build(FolderOptions(folder=str(folder), device="cpu"))
    assert not marker.exists()


@pytest.mark.parametrize("backbone", ["resnet18", "someone/resnet"])
def test_the_net_is_not_asked_for_a_backbone(tmp_path: Path, backbone: str, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[object] = []

    def fail(host: object, *rest: object, **more: object) -> None:
        asked.append(host)
        raise OSError("there is no net in tests")

    folder = saved(detr, tmp_path)
    changed(backbone_config=None, backbone=backbone, backbone_kwargs={"out_indices": [1, 2, 3, 4]})(folder)
    monkeypatch.setattr(socket, "getaddrinfo", fail)
    monkeypatch.delenv("HF_HUB_OFFLINE", raising=False)
    with pytest.raises(GearError, match="gear fetches nothing") as caught:
        detect2d.build(DetectorFolderOptions(folder=str(folder), device="cpu"))
    assert not asked and str(folder) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("make", [detr, conditional_detr, deformable_detr])
@pytest.mark.parametrize("weights", ["folder", "none"])
@pytest.mark.parametrize("is_dilated", [False, True])
def test_a_backbone_of_timms_may_be_named_as_transformers_4_does(
    tmp_path: Path, make: Callable[..., Any], weights: str, is_dilated: bool
) -> None:
    backbone = {"model_type": "timm_backbone", "backbone": "test_resnet", "num_channels": 3}
    places = {"out_indices": [2, 3, 4]}
    stride = {"output_stride": 16} if is_dilated else {}
    described = transformers.TimmBackboneConfig(**backbone, **places, **stride)
    folder = saved(lambda: make(described), tmp_path)
    options = DetectorFolderOptions(folder=str(folder), device="cpu", weights=weights)
    wanted: Any = detect2d.build(options)
    named = {"use_timm_backbone": True, "backbone": "test_resnet", "backbone_kwargs": {"in_chans": 3, **places}}
    changed(backbone_config=None, dilation=is_dilated, **named)(folder)
    found: Any = detect2d.build(options)
    state = found.module().state_dict()
    assert all(torch.equal(value, state[key]) for key, value in wanted.module().state_dict().items())
    pictures = {"left": torch.rand(1, 3, 64, 128)}
    torch.testing.assert_close(found(pictures), wanted(pictures), rtol=0, atol=0)


def test_a_backbone_of_timms_may_have_no_options(tmp_path: Path) -> None:
    described = transformers.TimmBackboneConfig(backbone="test_resnet", out_indices=[1, 2, 3, 4])
    folder = saved(lambda: detr(described), tmp_path)
    path = folder / "config.json"
    said = {**json.loads(path.read_text()), "backbone_config": None, "backbone": "test_resnet"}
    path.write_text(json.dumps({**said, "use_timm_backbone": True, "backbone_kwargs": None}))
    assert detect2d.build(DetectorFolderOptions(folder=str(folder), device="cpu"))


@pytest.mark.parametrize("folder", ["", "nowhere"])
def test_a_missing_folder_gets_one_line(folder: str) -> None:
    with pytest.raises(GearError, match="save_pretrained"):
        semseg.build(FolderOptions(folder=folder))


def test_a_folder_of_another_kind_gets_one_line(tmp_path: Path) -> None:
    saved(glpn, tmp_path)
    with pytest.raises(GearError, match="no network for ObjectDetection"):
        detect2d.build(DetectorFolderOptions(folder=str(tmp_path)))


@pytest.mark.parametrize("most", [0, -3])
def test_the_farthest_depth_must_be_some_metres(tmp_path: Path, most: int) -> None:
    changed(max_depth=most)(saved(glpn, tmp_path))
    with pytest.raises(GearError, match=f"config.json: max_depth must be a number of metres above 0, got {most}"):
        depth.build(DepthFolderOptions(folder=str(tmp_path), device="cpu"))


@pytest.mark.parametrize("facts", [{"patch_size": -1}, {"patch_size": 0}, {"reassemble_factors": []}], ids=str)
def test_a_network_that_is_built_but_does_not_run_gets_one_line(tmp_path: Path, facts: dict[str, Any]) -> None:
    changed(**facts)(saved(lambda: depth_anything("metric"), tmp_path))
    model: Any = depth.build(DepthFolderOptions(folder=str(tmp_path), device="cpu"))
    with pytest.raises(GearError, match="the network does not run on 140 x 70 pixels; check ") as caught:
        model.predict({"left": np.zeros((70, 140, 3), np.uint8)})
    assert str(caught.value).startswith(str(tmp_path)) and "\n" not in str(caught.value)


@pytest.mark.parametrize("weights", ["folder", "none"])
def test_weights_of_half_precision_take_pictures(tmp_path: Path, weights: str) -> None:
    folder = saved(lambda: yolos().half(), tmp_path)
    model: Any = detect2d.build(DetectorFolderOptions(folder=str(folder), device="cpu", weights=weights))
    model.predict({"left": np.zeros((64, 128, 3), np.uint8)})
    assert {weight.dtype for weight in model.graph.parameters()} == {torch.float32}


def test_a_folder_is_opened_without_a_word(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder = saved(segformer, tmp_path)
    with_weights(lambda state: state.update({"auxiliary.weight": torch.zeros(3)}))(folder)
    capfd.readouterr()
    semseg.build(FolderOptions(folder=str(folder), device="cpu"))
    assert capfd.readouterr() == ("", "")
