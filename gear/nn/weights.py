"""Weights on disk: safetensors, strictly loaded; published files are read without running anything in them."""

from __future__ import annotations

import functools
import importlib.metadata
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save as to_bytes
from torch import Tensor, nn

from gear.dataset.files import write_whole
from gear.nn.options import NONE, SHIPPED, NetworkOptions
from gear.nn.runtime import seeded
from gear.values.errors import GearError

GROUP = "gear.weights"
"""Entry points of this group name a module whose `FOLDER` holds `models/` and `patches/`."""

OPTIONAL = "num_batches_tracked"
"""Files older than this counter lack it; nothing uses it."""

SHOWN_KEYS = 3

GraphT = TypeVar("GraphT", bound=nn.Module)


def build_graph(make: Callable[[], GraphT], options: NetworkOptions, name: str) -> GraphT:
    """A network's graph with the weights that its options ask for.

    Args:
        make: builds the graph; its layers draw their first weights from `options.seed`.
        options: of the network.
        name: of the model plugin, for the shipped weights.

    Raises:
        GearError: the weights are not there, or are of another network.
    """
    path = resolve(options.weights, name)
    with seeded(options.seed):
        graph = make()
    if path is not None:
        load_into(graph, path)
    return graph


def resolve(weights: str, name: str) -> Path | None:
    """The file that the option `weights` of network `name` means; None for random weights.

    Raises:
        GearError: there is no such file, or none is shipped.
    """
    if weights == NONE:
        return None
    if weights != SHIPPED:
        return Path(weights)
    path = shipped(name)
    if path is None:
        raise GearError(
            f"{name} has no weights here: install mujoco-gear-weights, or say weights=FILE.safetensors "
            "(gear weights convert makes one of a published file), or weights=none for random ones"
        )
    return path


def shipped(name: str) -> Path | None:
    """The reference weights of a network, where an installed package has them."""
    for folder in shipped_folders():
        path = folder / "models" / f"{name}.safetensors"
        if path.is_file():
            return path
    return None


@functools.cache
def shipped_folders() -> tuple[Path, ...]:
    """Folders of the installed weights packages."""
    entries = sorted(importlib.metadata.entry_points(group=GROUP), key=lambda entry: entry.name)
    return tuple(Path(entry.load().FOLDER) for entry in entries)


def load_into(network: nn.Module, path: str | Path) -> dict[str, str]:
    """Loads a safetensors file into a network, strictly; returns the file's own metadata.

    Raises:
        GearError: there is no such file, it is no safetensors, or it is of another network.
    """
    state, metadata = read(path)
    problems = mismatches(network.state_dict(), state)
    if problems:
        raise GearError(f"{path}: not this network's weights: {'; '.join(problems)}")
    network.load_state_dict(state, strict=False)
    return metadata


def mismatches(wanted: Mapping[str, Tensor], given: Mapping[str, Tensor]) -> list[str]:
    """What keeps a state from being loaded: keys that are missing, keys too many, shapes that differ."""
    missing = [key for key in wanted if key not in given and not key.endswith(OPTIONAL)]
    surplus = [key for key in given if key not in wanted]
    shapes = [
        f"{key} is {tuple(given[key].shape)}, not {tuple(wanted[key].shape)}"
        for key in wanted
        if key in given and given[key].shape != wanted[key].shape
    ]
    found = {"missing": missing, "not known": surplus, "of another shape": shapes}
    return [f"{len(keys)} {what} ({_few(keys)})" for what, keys in found.items() if keys]


def read(path: str | Path) -> tuple[dict[str, Tensor], dict[str, str]]:
    """The tensors of a safetensors file, in float32 where they were stored shorter, and its metadata.

    Raises:
        GearError: there is no such file, or it is no safetensors.
    """
    if not Path(path).is_file():
        raise GearError(f"{path}: there is no such weights file")
    try:
        with safe_open(str(path), framework="pt") as opened:
            metadata = dict(opened.metadata() or {})
            state = {key: opened.get_tensor(key) for key in opened.keys()}  # noqa: SIM118
    except SafetensorError as error:
        raise GearError(
            f"{path}: not a safetensors file ({error}); gear weights convert makes one of a published file"
        ) from error
    return {k: v.float() if v.dtype in (torch.float16, torch.bfloat16) else v for k, v in state.items()}, metadata


def write(path: str | Path, state: Mapping[str, Tensor], metadata: Mapping[str, str], *, halves: bool = False) -> None:
    """Writes tensors whole or not at all.

    Args:
        path: of the file.
        state: by key.
        metadata: any texts.
        halves: whether weights of two dimensions and more are stored in float16; statistics and biases never are.
    """
    tensors = {key: value.detach().cpu().clone().contiguous() for key, value in state.items()}
    if halves:
        tensors = {key: value.half() if _may_halve(value) else value for key, value in tensors.items()}
    target = Path(path)
    write_whole(target.parent, target.name, to_bytes(tensors, dict(metadata)))


def _may_halve(tensor: Tensor) -> bool:
    return tensor.dtype == torch.float32 and tensor.dim() > 1


def _few(keys: list[Any]) -> str:
    return ", ".join(keys[:SHOWN_KEYS]) + (", …" if len(keys) > SHOWN_KEYS else "")
