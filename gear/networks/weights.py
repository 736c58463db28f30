"""Reads and writes weights files (safetensors) and loads them strictly: every key and shape must fit."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save as to_bytes
from torch import Tensor, nn

from gear.dataset.files import write_alone
from gear.networks.options import NetworkOptions
from gear.networks.runtime import seeded
from gear.networks.shipped import check_file, not_safetensors, resolve
from gear.values.errors import GearError

OPTIONAL = "num_batches_tracked"
"""Name of a counter of batch normalisation that older files lack and that no computation uses."""

SHORT = (torch.float16, torch.bfloat16, torch.float8_e4m3fn, torch.float8_e5m2)
"""Floating-point formats with fewer bits than the float32 of gear's networks; such tensors are converted when they
are read.
"""

SHOWN_KEYS = 3

HEADER_AT = 8
"""Offset of the JSON header in bytes. A safetensors file consists of the header's length, the header, and the
tensors.
"""

LEAST_SHARED = 0.25
"""Smallest share of a network's values that another network's file must provide to count as a file of the same
trunk. Heads are small; a few equal layers can be a coincidence.
"""

GraphT = TypeVar("GraphT", bound=nn.Module)


def build_graph(make: Callable[[], GraphT], options: NetworkOptions, name: str) -> GraphT:
    """Builds a network's torch module with the weights that its options select.

    Args:
        make: function that builds the graph; its layers draw their initial weights with `options.seed`.
        options: options of the network.
        name: name of the model plugin, which determines the shipped weights.

    Raises:
        GearError: the weights do not exist, or belong to another network.
    """
    path = resolve(options.weights, name)
    with seeded(options.seed):
        graph = make()
    if path is not None:
        load_into(graph, path)
    return graph


def load_into(network: nn.Module, path: str | Path) -> dict[str, str]:
    """Loads a safetensors file into a network; every key and shape must fit.

    Args:
        network: the torch module; it is changed in place.
        path: the safetensors file.

    Returns:
        The file's metadata.

    Raises:
        GearError: the file does not exist, is not safetensors, or belongs to another network.
    """
    state, metadata = read(path)
    problems = mismatches(network.state_dict(), state)
    if problems:
        raise GearError(f"{path}: not this network's weights: {'; '.join(problems)}")
    network.load_state_dict(state, strict=False)
    return metadata


def load_trunk(network: nn.Module, path: str | Path) -> tuple[int, int]:
    """Loads those tensors of another network's file whose keys and shapes fit; the other weights are not changed.

    Args:
        network: the torch module; it is changed in place.
        path: the safetensors file.

    Returns:
        The number of the network's values that were loaded, and the number of all its values.

    Raises:
        GearError: the file does not exist, is not safetensors, or shares less than `LEAST_SHARED` of the network's
            values.
    """
    given, _ = read(path)
    wanted = network.state_dict()
    shared = {
        key: given[key] for key in wanted if key in given and not mismatches({key: wanted[key]}, {key: given[key]})
    }
    loaded, total = (sum(tensor.numel() for tensor in state.values()) for state in (shared, wanted))
    if loaded < LEAST_SHARED * total:
        raise GearError(
            f"{path}: has {loaded / total:.0%} of this network's numbers under its keys and in its shapes: "
            f"no trunk of it (that would be {LEAST_SHARED:.0%})"
        )
    network.load_state_dict(shared, strict=False)
    return loaded, total


def mismatches(expected: Mapping[str, Tensor], state: Mapping[str, Tensor]) -> list[str]:
    """Lists the reasons why tensors from a file do not fit a network; the list is empty if they fit.

    The reasons are missing and unknown keys, wrong shapes, wrong kinds of numbers, and numbers that are not finite.

    Args:
        expected: the network's own tensors by key.
        state: the tensors that are to be loaded, by key.
    """
    missing = [key for key in expected if key not in state and not key.endswith(OPTIONAL)]
    surplus = [key for key in state if key not in expected]
    shared = [key for key in expected if key in state]
    shapes = [
        f"{key} is {tuple(state[key].shape)}, not {tuple(expected[key].shape)}"
        for key in shared
        if state[key].shape != expected[key].shape
    ]
    kinds = [
        key
        for key in shared
        if state[key].is_floating_point() != expected[key].is_floating_point() and not key.endswith(OPTIONAL)
    ]
    broken = [key for key in shared if not _finite(state[key])]
    found = {
        "missing": missing,
        "not known": surplus,
        "of another shape": shapes,
        "of integers where fractions belong, or the other way round": kinds,
        "with numbers that are not finite": broken,
    }
    return [f"{len(keys)} {what} ({_few(keys)})" for what, keys in found.items() if keys]


def read(path: str | Path) -> tuple[dict[str, Tensor], dict[str, str]]:
    """Reads the tensors of a safetensors file and its metadata, both by key.

    Shorter formats such as float16 are converted to float32.

    Args:
        path: the safetensors file.

    Raises:
        GearError: the file does not exist, or is not safetensors.
    """
    check_file(Path(path))
    try:
        with safe_open(str(path), framework="pt") as opened:
            metadata = dict(opened.metadata() or {})
            state = {key: opened.get_tensor(key) for key in opened.keys()}  # noqa: SIM118
    except (SafetensorError, OSError) as error:
        raise not_safetensors(path, error) from error
    return {key: value.float() if value.dtype in SHORT else value for key, value in state.items()}, metadata


def write(path: str | Path, state: Mapping[str, Tensor], metadata: Mapping[str, str], *, halves: bool = False) -> None:
    """Writes a safetensors file; the file appears whole or not at all.

    Args:
        path: path of the file.
        state: tensors by parameter name.
        metadata: texts by key.
        halves: whether tensors of two and more dimensions are stored in float16.
    """
    write_alone(Path(path), serialised(state, metadata, halves=halves))


def serialised(state: Mapping[str, Tensor], metadata: Mapping[str, str], *, halves: bool = False) -> bytes:
    """The bytes of a safetensors file; the same tensors and metadata always give the same bytes.

    Args:
        state: tensors by key.
        metadata: texts by key; `gear.networks.shipped.WeightsFile` lists those that gear reads.
        halves: whether tensors of two and more dimensions are stored in float16. Statistics, biases, and tensors with
            values outside the range of float16 are never shortened.
    """
    tensors = {key: value.detach().cpu().clone().contiguous() for key, value in state.items()}
    if halves:
        tensors = {key: value.half() if _may_halve(value) else value for key, value in tensors.items()}
    return _in_order(to_bytes(tensors, dict(metadata)))


def _in_order(data: bytes) -> bytes:
    """The same safetensors file with sorted metadata, since the library writes them in random order."""
    length = int.from_bytes(data[:HEADER_AT], "little")
    header = json.loads(data[HEADER_AT : HEADER_AT + length])
    header["__metadata__"] = dict(sorted(header.get("__metadata__", {}).items()))
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % HEADER_AT)  # tensors start at multiples of eight bytes
    return len(text).to_bytes(HEADER_AT, "little") + text + data[HEADER_AT + length :]


def _finite(tensor: Tensor) -> bool:
    """Whether all numbers are finite; tensors without storage (lists of published keys) count as finite."""
    return tensor.is_meta or bool(torch.isfinite(tensor).all())


def _may_halve(tensor: Tensor) -> bool:
    is_matrix = tensor.dtype == torch.float32 and tensor.dim() > 1
    return is_matrix and bool((tensor.abs() <= torch.finfo(torch.float16).max).all())


def _few(keys: list[Any]) -> str:
    return ", ".join(keys[:SHOWN_KEYS]) + (", …" if len(keys) > SHOWN_KEYS else "")
