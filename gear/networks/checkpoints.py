"""Reads published weights without running anything that a file contains."""

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

from gear.networks.checkpoint_states import Candidate, entries_of
from gear.networks.shipped import check_file
from gear.networks.weights import read
from gear.values.errors import GearError

PARALLEL = "module."
"""Prefix that `DataParallel` adds to every key."""

_scalar: Any = np.float64(0).__reduce__()[0]
_array: Any = np.zeros(1).__reduce__()[0]
"""Functions that NumPy's pickles call for scalars and arrays; their names differ between versions of NumPy."""

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
"""Names of classes and functions in pickles that are safe to read.

Numbers and arrays of NumPy, such as the best metric so far; the parsed command line; paths, which are read as pure ones
that touch no disk.
"""

STATE_DICT_ALONE = "state dict alone (torch.save(model.state_dict(), FILE))"

LOOKED_AT_BYTES = 1 << 20
"""Bytes of a pickle that are searched for the class that it asks for."""

HARMLESS = ("torch", "collections", "numpy", "argparse")
"""Packages that checkpoints usually refer to."""


def read_published(path: str | Path) -> dict[str, Tensor]:
    """A network's tensors by key, from a checkpoint of PyTorch (zip or older format) or a safetensors file.

    If there are several entries, the most probable one is read. The prefix `module.`, which `DataParallel` adds to
    every key, is removed.

    Raises:
        GearError: the file does not exist, cannot be read, asks for code to be run, or holds no network.
    """
    state = dict(read_entries(path)[0].state)
    if state and all(key.startswith(PARALLEL) for key in state):
        state = {key.removeprefix(PARALLEL): value for key, value in state.items()}
    return state


def read_entries(path: str | Path) -> list[Candidate]:
    """The mappings of a checkpoint or a safetensors file that hold tensors, the likeliest network first.

    Raises:
        GearError: the file does not exist, cannot be read, asks for code to be run, or holds no tensors.
    """
    file = Path(path)
    check_file(file)
    return entries_of(read(file)[0] if file.suffix == ".safetensors" else _load(file), file)


def _load(path: Path) -> Any:
    """The content of a file as `torch.load` reads it when nothing in it may be run.

    Raises:
        GearError: it cannot be read in this way.
    """
    try:
        with torch.serialization.safe_globals(PLAIN_GLOBALS), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # about newer protocols of pickle
            return torch.load(path, map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as error:
        found = re.search(r"GLOBAL ([\w.]+)", str(error))
        wanted = found[1] if found else _foreign_global(path)
        if wanted is None:
            # torch's message suggests to read the file unsafely; the reason alone is passed on.
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
    """The first name that a bare pickle would import and that is not torch's. Nothing of the file is run."""
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
