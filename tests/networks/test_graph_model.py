"""Graph models of TensorFlow.js: their numbers come out in torch's layout, and damaged or hostile ones are refused."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from gear.networks import graph_model
from gear.networks.checkpoints import read_entries
from gear.networks.graph_model import read_graph_model
from gear.values.errors import GearError
from gear.values.rng import derive_rng
from tests.networks.graph_models import write_graph_model


@pytest.fixture
def layers() -> dict[str, Any]:
    rng = derive_rng(0, "layers")
    weight, bias = rng.normal(size=(4, 3, 5, 2)), rng.normal(size=4)
    return {"net/convolution": (weight, bias), "net/convolution_1": (rng.normal(size=(2, 4, 1, 1)), None)}


@pytest.mark.parametrize("halves", [True, False])
def test_weights_and_biases_are_in_torchs_layout(tmp_path: Path, layers: dict[str, Any], halves: bool) -> None:
    path = write_graph_model(tmp_path, layers, halves=halves)
    (entry,) = read_entries(path)
    kind = np.float16 if halves else np.float32
    weight, bias = layers["net/convolution"]
    assert set(entry.state) == {"net/convolution.weight", "net/convolution.bias", "net/convolution_1.weight"}
    torch.testing.assert_close(entry.state["net/convolution.weight"], torch.tensor(weight.astype(kind)).float())
    torch.testing.assert_close(entry.state["net/convolution.bias"], torch.tensor(bias.astype(kind)).float())


def test_depthwise_kernels_have_one_input_channel(tmp_path: Path) -> None:
    path = write_graph_model(tmp_path, {"a": (np.arange(18.0).reshape(1, 2, 3, 3), None)})
    text = path.read_text().replace('"Conv2D"', '"DepthwiseConv2dNative"')
    path.write_text(text)
    assert read_graph_model(path)["a.weight"].shape == (2, 1, 3, 3)
    assert read_graph_model(path)["a.weight"].flatten().tolist() == list(np.arange(18.0))


def test_bytes_are_scaled(tmp_path: Path) -> None:
    path = write_graph_model(tmp_path, {"a": (np.zeros((1, 1, 1, 2)), None)})
    graph = json.loads(path.read_text())
    graph["weightsManifest"][0]["weights"][0]["quantization"] = {"dtype": "uint8", "scale": 0.5, "min": -1.0}
    path.write_text(json.dumps(graph))
    (tmp_path / "net.bin").write_bytes(bytes([0, 4]))
    assert read_graph_model(path)["a.weight"].flatten().tolist() == [-1.0, 1.0]


def edited(change: Callable[[dict[str, Any]], None]) -> Callable[[Path], None]:
    def edit(path: Path) -> None:
        graph = json.loads(path.read_text())
        change(graph)
        path.write_text(json.dumps(graph))

    return edit


def entry_of(graph: dict[str, Any]) -> dict[str, Any]:
    entry: dict[str, Any] = graph["weightsManifest"][0]["weights"][0]
    return entry


BAD: dict[str, Callable[[Path], Any]] = {
    "no JSON": lambda path: path.write_text("{"),
    "another JSON": lambda path: path.write_text("[]"),
    "deeply nested": lambda path: path.write_text("[" * 100_000),
    "cut numbers": lambda path: path.with_name("net.bin").write_bytes(b"\0" * 5),
    "too many numbers": lambda path: path.with_name("net.bin").write_bytes(b"\0" * 5000),
    "no numbers": lambda path: path.with_name("net.bin").unlink(),
    "a FIFO": lambda path: (path.with_name("net.bin").unlink(), os.mkfifo(path.with_name("net.bin"))),
    "a file elsewhere": edited(lambda graph: graph["weightsManifest"][0].update(paths=["../net.bin"])),
    "a device": edited(lambda graph: graph["weightsManifest"][0].update(paths=["/dev/zero"])),
    "the folder": edited(lambda graph: graph["weightsManifest"][0].update(paths=[".."])),
    "a negative side": edited(lambda graph: entry_of(graph).update(shape=[-1, -5, 3, 4])),
    "an immense shape": edited(lambda graph: entry_of(graph).update(shape=[1 << 40, 1 << 40, 1, 1])),
    "an infinite side": lambda path: path.write_text(path.read_text().replace('"shape": [', '"shape": [1e999, ', 1)),
    "an immense scale": edited(
        lambda graph: entry_of(graph).update(quantization={"dtype": "uint8", "scale": 10**400, "min": 0})
    ),
    "an unknown type": edited(lambda graph: entry_of(graph).update(quantization=None, dtype="string")),
    "a loop": edited(lambda graph: [node.update(input=[node["name"]] * 2) for node in graph["modelTopology"]["node"]]),
    "no convolution": edited(lambda graph: graph["modelTopology"].update(node=[])),
}


@pytest.mark.parametrize("kind", BAD)
def test_bad_files_are_refused_in_one_line(tmp_path: Path, layers: dict[str, Any], kind: str) -> None:
    path = write_graph_model(tmp_path / "in", layers)
    (tmp_path / "net.bin").write_bytes((tmp_path / "in" / "net.bin").read_bytes())
    BAD[kind](path)
    with pytest.raises(GearError) as error:
        read_entries(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


def test_files_beyond_the_limit_are_not_read(
    tmp_path: Path, layers: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_graph_model(tmp_path, layers)
    monkeypatch.setattr(graph_model, "LARGEST_WEIGHTS_BYTES", 10)
    with pytest.raises(GearError, match=r"net\.bin is larger than"):
        read_graph_model(path)


def test_all_files_together_have_a_limit(
    tmp_path: Path, layers: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_graph_model(tmp_path, layers)
    size = (tmp_path / "net.bin").stat().st_size
    graph = json.loads(path.read_text())
    graph["weightsManifest"].append({"paths": ["net.bin"] * 10_000, "weights": []})
    path.write_text(json.dumps(graph))
    read: list[str] = []
    real = graph_model.read_bytes
    monkeypatch.setattr(graph_model, "read_bytes", lambda found: (read.append(found.name), real(found))[1])
    monkeypatch.setattr(graph_model, "LARGEST_WEIGHTS_BYTES", 3 * size)
    with pytest.raises(GearError, match=r"net\.bin is larger than"):
        read_graph_model(path)
    assert read.count("net.bin") == 3


def test_a_cycle_is_followed_once() -> None:
    count = 1000
    visits: list[str] = []

    class Nodes(dict[str, Any]):
        def get(self, name: str, default: Any = None) -> Any:
            visits.append(name)
            return super().get(name, default)

    nodes = Nodes({str(i): {"op": "Identity", "input": [str((i + 1) % count)]} for i in range(count)})
    origins: dict[str, str] = {}
    assert len({graph_model._origin(nodes, str(i), origins) for i in range(count)}) == 1
    assert len(visits) == count
