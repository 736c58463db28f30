"""Writes graph models of TensorFlow.js, as its converter does."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

Numbers = np.ndarray[Any, np.dtype[Any]]


def write_graph_model(
    folder: Path, layers: Mapping[str, tuple[Numbers, Numbers | None]], *, halves: bool = True
) -> Path:
    """Writes a graph of convolutions, each followed by a transposition and an addition.

    Args:
        folder: folder of the two files.
        layers: weight (out, in, rows, columns) and bias (out,) of each convolution.
        halves: whether the numbers are stored in float16.
    """
    nodes: list[dict[str, Any]] = [{"name": "input", "op": "Placeholder"}]
    entries: list[dict[str, Any]] = []
    data = b""
    for name, (weight, bias) in layers.items():
        constants = {f"{name}/kernel": weight.transpose(2, 3, 1, 0)} | ({} if bias is None else {f"{name}/b": bias})
        for constant, values in constants.items():
            entry: dict[str, Any] = {"name": constant, "shape": list(values.shape), "dtype": "float32"}
            if halves:
                entry["quantization"] = {"dtype": "float16", "original_dtype": "float32"}
            entries.append(entry)
            nodes.append({"name": constant, "op": "Const"})
            data += np.ascontiguousarray(values, "<f2" if halves else "<f4").tobytes()
        nodes.append({"name": name, "op": "Conv2D", "input": ["input", f"{name}/kernel"]})
        if bias is not None:
            nodes.append({"name": f"{name}/transposed", "op": "Transpose", "input": [f"{name}:0", "permutation"]})
            nodes.append({"name": f"{name}/sum", "op": "AddV2", "input": [f"{name}/transposed", f"{name}/b"]})
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "net.bin").write_bytes(data)
    path = folder / "net.json"
    graph = {
        "format": "graph-model",
        "modelTopology": {"node": nodes},
        "weightsManifest": [{"paths": ["net.bin"], "weights": entries}],
    }
    path.write_text(json.dumps(graph))
    return path
