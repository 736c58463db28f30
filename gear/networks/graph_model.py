"""Reads the weights of a TensorFlow.js graph model: a JSON file with the graph, and files of numbers beside it.

The graph is not run. Every convolution gives two tensors, in the layout of torch: `<name>.weight` and, where an
addition of a constant follows, `<name>.bias`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gear.dataset.files import read_bytes
from gear.values.errors import GearError

SUFFIX = ".json"

LARGEST_GRAPH_BYTES = 16 << 20
LARGEST_WEIGHTS_BYTES = 1 << 30
"""Largest sizes of the graph's file, and of all of its files of numbers together."""

CONVOLUTIONS = ("Conv2D", "DepthwiseConv2dNative")
ADDITIONS = ("Add", "AddV2", "BiasAdd")
PASSING = ("Identity", "Transpose")
"""Operations between a convolution and its addition that change no value."""

TYPES = {"float32": "<f4", "int32": "<i4", "uint8": "u1", "bool": "u1"}
SHORTENED = {"float16": "<f2", "uint8": "u1", "uint16": "<u2"}
"""NumPy's names of the types of stored numbers, and of those to which a file may shorten them."""


def read_graph_model(path: Path) -> dict[str, Tensor]:
    """Reads the weights of all convolutions of a TensorFlow.js graph model.

    Args:
        path: the JSON file of the graph; the files that it names lie beside it.

    Returns:
        Tensors by `<name of the convolution>.weight`, (out, in, rows, columns), and `.bias`, (out,).

    Raises:
        GearError: the files are damaged or too large, are no graph model, or name a file outside of their folder.
    """
    try:
        graph = json.loads(_read(path, LARGEST_GRAPH_BYTES))
        nodes = {str(node["name"]): node for node in graph["modelTopology"]["node"]}
        numbers = _numbers(path, graph["weightsManifest"])
        return _convolutions(nodes, numbers)
    except (ValueError, KeyError, TypeError, IndexError, AttributeError, RecursionError, OverflowError) as error:
        reason = f"{type(error).__name__}: {error}".splitlines()[0]
        raise GearError(f"{path}: not a graph model of TensorFlow.js that can be read ({reason})") from error


def _numbers(path: Path, manifest: Any) -> dict[str, np.ndarray[Any, np.dtype[Any]]]:
    """The constants by name, decompressed."""
    numbers: dict[str, np.ndarray[Any, np.dtype[Any]]] = {}
    left = LARGEST_WEIGHTS_BYTES
    for group in manifest:
        pieces: list[bytes] = []
        for name in group["paths"]:
            pieces.append(_read(_beside(path, name), left))
            left -= len(pieces[-1])
        data = b"".join(pieces)
        offset = 0
        for entry in group["weights"]:
            shape = [int(side) for side in entry["shape"]]
            if min(shape, default=1) < 0:
                raise ValueError(f"{entry['name']} has a negative side")
            shortened = entry.get("quantization")
            kind = np.dtype(SHORTENED[shortened["dtype"]] if shortened else TYPES[entry["dtype"]])
            count = int(np.prod(shape, dtype=object))
            if offset + count * kind.itemsize > len(data):
                raise ValueError(f"{entry['name']} reaches beyond the end of its file")
            values = np.frombuffer(data, kind, count, offset).reshape(shape)
            offset += count * kind.itemsize
            if shortened and kind.kind == "u":
                values = values * np.float32(shortened["scale"]) + np.float32(shortened["min"])
            numbers[str(entry["name"])] = values
        if offset != len(data):
            raise ValueError(f"{len(data) - offset} bytes are left over")
    return numbers


def _convolutions(nodes: Mapping[str, Any], numbers: Mapping[str, np.ndarray[Any, np.dtype[Any]]]) -> dict[str, Tensor]:
    """Weights and biases of the convolutions in the layout of torch."""
    weights: dict[str, Tensor] = {}
    origins: dict[str, str] = {}
    for name, node in nodes.items():
        if node["op"] in CONVOLUTIONS:
            kernel = numbers[_source(node["input"][1])]
            # From (rows, columns, in, out) to (out, in, rows, columns); depth-wise: (rows, columns, in, factor).
            order = (3, 2, 0, 1) if node["op"] == CONVOLUTIONS[0] else (2, 3, 0, 1)
            weights[f"{name}.weight"] = torch.from_numpy(np.array(kernel.transpose(order), np.float32, order="C"))
        elif node["op"] in ADDITIONS:
            first, second = (_origin(nodes, _source(each), origins) for each in node["input"][:2])
            for layer, constant in ((first, second), (second, first)):
                if layer in nodes and nodes[layer]["op"] in CONVOLUTIONS and constant in numbers:
                    bias = numbers[constant].reshape(-1)
                    weights[f"{layer}.bias"] = torch.from_numpy(np.array(bias, np.float32))
    if not weights:
        raise ValueError("it has no convolution")
    return weights


def _origin(nodes: Mapping[str, Any], name: str, origins: dict[str, str]) -> str:
    """The node whose values a node passes on unchanged; a node of the cycle if the nodes form one.

    Args:
        nodes: the nodes by name.
        name: name of the node.
        origins: known origins by name, to which those of all visited nodes are added.
    """
    visited: dict[str, None] = {}
    while name not in origins and name not in visited:
        node = nodes.get(name)
        if node is None or node["op"] not in PASSING:
            break
        visited[name] = None
        name = _source(node["input"][0])
    origin = origins.get(name, name)
    origins.update(dict.fromkeys(visited, origin))
    return origin


def _source(text: str) -> str:
    """The name of a node in an input's text, such as `^name` or `name:1`."""
    return str(text).removeprefix("^").partition(":")[0]


def _beside(path: Path, name: str) -> Path:
    """A file in the folder of the graph.

    Raises:
        ValueError: the name leads elsewhere.
    """
    if name in ("", ".", "..") or "/" in name or "\\" in name or "\0" in name:
        raise ValueError(f"{name!r} is not the name of a file beside it")
    return path.with_name(name)


def _read(path: Path, limit: int) -> bytes:
    if not path.is_file():
        raise ValueError(f"there is no file {path.name}")
    if path.stat().st_size > limit:
        raise ValueError(f"{path.name} is larger than the {limit >> 20} MiB that may still be read")
    return read_bytes(path)
