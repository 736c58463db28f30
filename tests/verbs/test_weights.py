from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import torch

from gear.cli.main import main
from gear.nn import shipped
from gear.nn.bisenet import BiSeNetX39
from gear.nn.ddrnet import DDRNet23Slim
from gear.nn.weights import read
from gear.values.errors import GearError
from gear.verbs.weights.convert import convert_weights
from gear.verbs.weights.show import show_weights


@pytest.fixture(scope="module")
def official(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Files of the shapes that the authors publish, with random numbers in them."""
    folder = tmp_path_factory.mktemp("official")
    ddrnet: dict[str, Any] = {f"model.{key}": value for key, value in DDRNet23Slim(19).state_dict().items()}
    torch.save(ddrnet | {"loss.criterion.weight": torch.ones(19)}, folder / "ddrnet.pth")
    bisenet = BiSeNetX39(19).state_dict()
    content = {"model": bisenet, "optimizer": {"state": {}}, "epoch": 79, "iteration": 80000}
    torch.save(content, folder / "bisenet.pth", _use_new_zipfile_serialization=False)
    return {path.stem: path for path in folder.iterdir()}


@pytest.mark.parametrize(
    ("model", "file", "tensors"), [("ddrnet23_slim", "ddrnet", 346), ("bisenet_x39", "bisenet", 461)]
)
def test_official_files_become_safetensors(
    official: dict[str, Path], tmp_path: Path, model: str, file: str, tensors: int, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "new" / f"{model}.safetensors"
    assert main(["weights", "convert", model, str(official[file]), str(out), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["tensors"] == tensors and said["model"] == model
    facts = show_weights(str(out))
    assert facts.sha256 == said["sha256"]
    assert facts.file.metadata["model"] == model and facts.file.metadata["source"] == f"{file}.pth"
    assert len(facts.file.metadata["source_sha256"]) == 64
    state, _ = read(out)
    content = torch.load(official[file], weights_only=True)
    old = content.get("model", content)
    key = "model.spp.scale0.2.weight" if model == "ddrnet23_slim" else "heads.2.conv_1x1.bias"
    assert torch.equal(state[key.removeprefix("model.")], old[key])
    assert main(["weights", "convert", model, str(out), str(tmp_path / "again.safetensors")]) == 0, "its own output too"


def test_same_file_same_bytes(official: dict[str, Path], tmp_path: Path) -> None:
    one = convert_weights("bisenet_x39", official["bisenet"], tmp_path / "a.safetensors")
    two = convert_weights("bisenet_x39", official["bisenet"], tmp_path / "b.safetensors")
    half = convert_weights("bisenet_x39", official["bisenet"], tmp_path / "c.safetensors", halves=True)
    assert one.sha256 == two.sha256 != half.sha256
    assert half.size_mb < 0.6 * one.size_mb
    assert "--set weights=" in one.summary() and one.sha256 in one.summary()


def test_what_does_not_fit_is_refused_and_nothing_is_written(official: dict[str, Path], tmp_path: Path) -> None:
    out = tmp_path / "a.safetensors"
    with pytest.raises(GearError, match=r"not weights of bisenet_x39: 394 missing .* 347 not known"):
        convert_weights("bisenet_x39", official["ddrnet"], out)
    with pytest.raises(GearError, match=r"16 not known \(heads\.0"):
        convert_weights("bisenet_x39", official["bisenet"], out, settings=["auxiliary=false"])
    with pytest.raises(GearError, match=r"end in \.safetensors"):
        convert_weights("bisenet_x39", official["bisenet"], tmp_path / "a.pth")
    assert list(tmp_path.iterdir()) == []
    convert_weights("bisenet_x39", official["bisenet"], out)
    with pytest.raises(GearError, match="is the file to read"):
        convert_weights("bisenet_x39", out, out)


def test_show_prints_what_the_file_says(
    official: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "models" / "bisenet_x39.safetensors"
    convert_weights("bisenet_x39", official["bisenet"], out)
    assert main(["weights", "show", str(out)]) == 0
    text = capsys.readouterr().out
    assert "461 tensors" in text and "source: bisenet.pth" in text
    monkeypatch.setattr(shipped, "shipped_folders", lambda: (tmp_path,))
    assert show_weights("bisenet_x39").file.path == out
    assert main(["weights", "show", str(official["bisenet"])]) == 2
    assert "gear weights convert" in capsys.readouterr().err
