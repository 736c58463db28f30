"""Reads published weights files without running code that a file may contain."""

from __future__ import annotations

import argparse
import pickle
import pickletools
import re
import types
import warnings
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gear.networks import graph_model
from gear.networks.checkpoint_states import Candidate, entries_of
from gear.networks.shipped import check_file
from gear.networks.weights import read
from gear.values.errors import GearError

PARALLEL = "module."
"""Prefix that torch's `DataParallel` puts before every key of a state dict."""

_scalar: Any = np.float64(0).__reduce__()[0]
_array: Any = np.zeros(1).__reduce__()[0]
"""NumPy's functions that make scalars and arrays while a pickle is read; their names differ between NumPy versions."""

PATHS = (
    (PurePosixPath, "PosixPath"),
    (PurePosixPath, "PurePosixPath"),
    (PureWindowsPath, "WindowsPath"),
    (PureWindowsPath, "PureWindowsPath"),
)

PLAIN_GLOBALS: list[Any] = [
    (_scalar, "numpy.core.multiarray.scalar"),
    (_scalar, "numpy._core.multiarray.scalar"),
    (_array, "numpy.core.multiarray._reconstruct"),
    (_array, "numpy._core.multiarray._reconstruct"),
    np.dtype,
    np.ndarray,
    *(type(np.dtype(code)) for code in ("f2", "f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "?")),
    argparse.Namespace,
    types.SimpleNamespace,
    *((pure, f"{module}.{name}") for module in ("pathlib", "pathlib._local") for pure, name in PATHS),
]
"""Harmless classes and functions that checkpoints often contain besides tensors; loading them runs no code from
the file.

They are NumPy's numbers and arrays (the best metric so far), the parsed command line, and paths. Paths are read as pure
paths, which never touch the disk.
"""

STATE_DICT_ALONE = "state dict alone (torch.save(model.state_dict(), FILE))"

LOOKED_AT_BYTES = 1 << 20
"""Number of bytes at the start of a pickle that are searched for the name of the class that loading requires."""

HARMLESS = ("torch", "collections", "numpy", "argparse")
"""Packages to which checkpoints usually refer; a class of any other package is reported as the obstacle to loading."""


def read_published(path: str | Path) -> dict[str, Tensor]:
    """Reads a network's tensors by key from a checkpoint of PyTorch (zip or older format) or a safetensors file.

    If the file has several entries, the most likely one is read. The prefix `module.` of `DataParallel` is removed.

    Args:
        path: the file; its ending `.safetensors` or `.json` decides how it is read, all others are read as PyTorch's.

    Raises:
        GearError: the file does not exist, cannot be read, would run code, or holds no network.
    """
    state = dict(read_entries(path)[0].state)
    if state and all(key.startswith(PARALLEL) for key in state):
        state = {key.removeprefix(PARALLEL): value for key, value in state.items()}
    return state


def read_entries(path: str | Path) -> list[Candidate]:
    """Reads the mappings of a checkpoint or a safetensors file that hold tensors, the most likely network first.

    A graph model of TensorFlow.js (a JSON file) gives one mapping, with the weights of its convolutions.

    Args:
        path: the file; its ending `.safetensors` or `.json` decides how it is read, all others are read as PyTorch's.

    Raises:
        GearError: the file does not exist, cannot be read, would run code, or holds no tensors.
    """
    file = Path(path)
    check_file(file)
    if file.suffix == graph_model.SUFFIX:
        return entries_of(graph_model.read_graph_model(file), file)
    return entries_of(read(file)[0] if file.suffix == ".safetensors" else _load(file), file)


def _load(path: Path) -> Any:
    """The content of a file, read by `torch.load` with `weights_only`, so that none of it is run.

    Raises:
        GearError: the file cannot be read in this way.
    """
    try:
        with torch.serialization.safe_globals(PLAIN_GLOBALS), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # torch warns of newer pickle protocols
            return torch.load(path, map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as error:
        found = re.search(r"GLOBAL ([\w.]+)", str(error))
        wanted = found[1] if found else _foreign_global(path)
        if wanted is None:
            # torch's message suggests reading the file unsafely, so only the reason is taken from it.
            reason = re.search(r"WeightsUnpickler error: *(\S.*)", str(error))
            why = reason[1] if reason else "it is no plain pickle of tensors"
            raise GearError(f"{path}: not a checkpoint that can be read safely ({why})") from error
        raise GearError(
            f"{path}: refused, because reading it would run {wanted}; have somebody who trusts the file save its "
            f"{STATE_DICT_ALONE}, or get it as safetensors"
        ) from error
    except (RuntimeError, EOFError, ValueError, OSError, KeyError, AttributeError, IndexError) as error:
        if "TorchScript" in str(error):
            raise GearError(
                f"{path}: refused, because it is a TorchScript archive, which holds code; have somebody who trusts it "
                f"save its {STATE_DICT_ALONE}"
            ) from error
        raise GearError(f"{path}: not a checkpoint of PyTorch's ({_first_line(error)})") from error


def _foreign_global(path: Path) -> str | None:
    """The first name that a bare pickle would import from a package other than torch. The pickle is not run."""
    texts: list[str] = []
    memo: dict[int, str] = {}
    try:
        with path.open("rb") as file:
            for code, argument, _ in pickletools.genops(file.read(LOOKED_AT_BYTES)):
                if code.name == "GLOBAL":
                    texts += str(argument).split(" ", 1)
                elif "UNICODE" in code.name:
                    texts.append(str(argument))
                elif code.name == "MEMOIZE":
                    memo[len(memo)] = texts[-1] if texts else ""
                elif code.name in ("BINPUT", "LONG_BINPUT"):
                    memo[int(str(argument))] = texts[-1] if texts else ""
                elif code.name in ("BINGET", "LONG_BINGET"):
                    texts.append(memo.get(int(str(argument)), ""))
                if code.name.endswith("GLOBAL") and len(texts) > 1 and texts[-2].split(".")[0] not in HARMLESS:
                    return ".".join(texts[-2:])
    except (ValueError, OSError, IndexError, KeyError):
        return None
    return None


def _first_line(error: BaseException) -> str:
    return f"{type(error).__name__}: {(str(error).strip().splitlines() or ['nothing in it'])[0]}"
