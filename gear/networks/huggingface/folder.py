"""Opens networks of transformers from a local folder. The internet is not accessed, and neither pickles nor code
in the folder are run.
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import torch
from torch import nn

from gear.networks.depth.packages import need_transformers
from gear.networks.huggingface.options import FOLDER, FolderOptions
from gear.networks.huggingface.processor_file import read_mapping
from gear.networks.options import NONE
from gear.networks.runtime import seeded
from gear.networks.weights import OPTIONAL, load_into
from gear.values.errors import GearError

ADAPTER = "write an adapter (docs/how-to/write-a-model.md)"

SHOWN = 240
"""Largest number of characters that an error message quotes from a message of transformers."""

OF_TIMM = {"in_chans": "num_channels", "out_indices": "out_indices", "output_stride": "output_stride"}
"""Keys of `backbone_kwargs` in config files written before transformers 5, for backbones of timm, and the current
names of these keys.
"""

DILATED_STRIDE_PX = 16
"""Stride in pixels of the last feature map of a dilated backbone whose config states none."""


def open_folder(options: FolderOptions, auto: str) -> nn.Module:
    """Makes the network that a folder of transformers holds, in float32.

    Args:
        options: options of the network, which name the folder.
        auto: name of the class of transformers that opens this kind of network, such as `AutoModelForDepthEstimation`.

    Raises:
        GearError: the folder holds no network of this kind, or is damaged.
    """
    folder = Path(options.folder)
    if not options.folder or not (folder / "config.json").is_file():
        raise GearError(f"folder {options.folder!r} has no config.json; set folder to what save_pretrained wrote")
    read_mapping(folder / "config.json")
    if options.weights == FOLDER:
        _need_safetensors(folder)
    need_transformers()
    try:
        with _quietly(), _offline():
            graph, found = _opened(options, auto)
    except Exception as error:  # a damaged file may cause any exception in transformers
        raise _refused(folder, auto, error) from error
    _check(graph, found, folder)
    if options.weights not in (FOLDER, NONE):
        load_into(graph, options.weights)
    return graph


def start_from(folder_network: Any, auto: str) -> None:
    """Loads the weights of a folder into the network that was made from this folder (`gear train --init folder`).

    Args:
        folder_network: a `gear.networks.huggingface.network.FolderNetwork`.
        auto: name of the class of transformers that opens this kind of network, such as `AutoModelForDepthEstimation`.

    Raises:
        GearError: the folder has no weights that fit.
    """
    graph = open_folder(dataclasses.replace(folder_network.options, weights=FOLDER), auto)
    folder_network.module().load_state_dict(graph.state_dict())


def _opened(options: FolderOptions, auto: str) -> tuple[nn.Module, Mapping[str, Any]]:
    """The network, and the report of transformers about missing and unexpected weights."""
    import transformers

    kind: Any = getattr(transformers, auto)
    # By default transformers would ask the user, and run the folder's code after a "y".
    common: dict[str, Any] = {"local_files_only": True, "trust_remote_code": False}
    stored = read_mapping(Path(options.folder) / "config.json")
    described = _with_backbone(stored)
    config = (
        transformers.AutoConfig.from_pretrained(options.folder, **common)
        if described == stored
        else transformers.AutoConfig.for_model(**described)
    )
    if options.weights == FOLDER:
        # By default transformers loads the file's own precision, in which the network does not accept float32 pictures.
        loaded: tuple[nn.Module, Mapping[str, Any]] = kind.from_pretrained(
            options.folder,
            config=config,
            use_safetensors=True,
            dtype=torch.float32,
            output_loading_info=True,
            ignore_mismatched_sizes=True,  # `_check` reports them by name
            **common,
        )
        return loaded
    with seeded(options.seed):
        return kind.from_config(config, dtype=torch.float32, trust_remote_code=False), {}


def _with_backbone(config: Mapping[str, Any]) -> Mapping[str, Any]:
    """Converts a config.json in which a timm backbone is named next to its options to one in which it is described.

    transformers wrote DETRs in the first form before version 5; current versions would look the name up on the network.
    """
    name, options = config.get("backbone"), config.get("backbone_kwargs", {})
    if config.get("use_timm_backbone") is not True or config.get("backbone_config") is not None or not name:
        return config
    if options is None:
        return {key: value for key, value in config.items() if key != "backbone_kwargs"}
    if not isinstance(options, dict) or "out_indices" not in options or options.keys() - OF_TIMM:
        return config
    kept = {key: value for key, value in config.items() if "backbone" not in key}
    stride = {"output_stride": DILATED_STRIDE_PX} if config.get("dilation") else {}
    of_timm = {OF_TIMM[key]: value for key, value in options.items()}
    return {**kept, "backbone_config": {"model_type": "timm_backbone", "backbone": name, **stride, **of_timm}}


def _need_safetensors(folder: Path) -> None:
    """Checks that the weights are safetensors; pickles are refused, since opening one runs code.

    Raises:
        GearError: the folder has no safetensors, or its index names other files.
    """
    wanted = "open the network where you trust it and save it again with save_pretrained"
    if not any(folder.glob("*.safetensors")):
        raise GearError(f"{folder}: there is no model.safetensors, and gear reads no pickles; {wanted}")
    index = folder / "model.safetensors.index.json"
    if not (folder / "model.safetensors").is_file() and index.is_file():
        files = read_mapping(index).get("weight_map")
        if not isinstance(files, dict) or not all(str(name).endswith(".safetensors") for name in files.values()):
            raise GearError(f"{index}: weight_map must name files of safetensors only; {wanted}")


def _refused(folder: Path, auto: str, error: Exception) -> GearError:
    if "trust_remote_code" in str(error):
        return GearError(
            f"{folder}: its network is code of the folder's own (auto_map in config.json), which gear never runs; "
            f"save a network that transformers itself has, or {ADAPTER}"
        )
    if type(error).__name__ == "OfflineModeIsEnabled":
        return GearError(
            f"{folder}: config.json leaves something to the net, such as a backbone that it only names, and gear "
            "fetches nothing; open it with transformers where there is a net and save it again with save_pretrained"
        )
    wanted = auto.removeprefix("AutoModelFor")
    return GearError(
        f"{folder}: no network for {wanted}; check config.json and model.safetensors there: {in_one_line(error)}"
    )


def in_one_line(error: Exception) -> str:
    """Returns the type of an exception and the start of its message, in one line.

    Args:
        error: the exception, as transformers raised it.
    """
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text if len(text) <= SHOWN else text[:SHOWN] + '...'}"


def _check(graph: nn.Module, found: Mapping[str, Any], folder: Path) -> None:
    """Checks that the folder contains all weights and that they are finite numbers.

    Args:
        graph: the network.
        found: report of transformers; it lists weights that were initialised at random.
        folder: the folder.

    Raises:
        GearError: weights are missing, such as a head for depth in a classifier's folder, or are not finite.
    """
    name = type(graph).__name__
    lost = sorted(key for key in found.get("missing_keys", ()) if not key.endswith(OPTIONAL))
    if lost:
        raise GearError(f"{folder}: {len(lost)} weights of {name} are not there, such as {lost[0]}; check config.json")
    other = sorted(found.get("mismatched_keys", ()))
    if other:
        key, given, wanted = other[0]
        raise GearError(
            f"{folder}: {len(other)} weights do not fit config.json, such as {key}: {tuple(given)}, not {tuple(wanted)}"
        )
    for key, weights in graph.state_dict().items():
        if not bool(weights.isfinite().all()):
            raise GearError(f"{folder}: {key} holds NaN or infinity; fetch the folder or train the network again")


@contextlib.contextmanager
def _offline() -> Iterator[None]:
    """Context in which no library of Hugging Face accesses the network; `local_files_only` alone does not cover
    backbones.
    """
    from huggingface_hub import constants

    was = constants.HF_HUB_OFFLINE
    constants.HF_HUB_OFFLINE = True
    try:
        yield
    finally:
        constants.HF_HUB_OFFLINE = was


@contextlib.contextmanager
def _quietly() -> Iterator[None]:
    """Context in which transformers prints no progress bars and no tables; errors still contain the important part."""
    from transformers.utils import logging as settings

    had_bars, verbosity = settings.is_progress_bar_enabled(), settings.get_verbosity()
    settings.disable_progress_bar()
    settings.set_verbosity_error()
    try:
        yield
    finally:
        settings.set_verbosity(verbosity)
        if had_bars:
            settings.enable_progress_bar()
