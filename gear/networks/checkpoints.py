"""Weights that others publish: read without running anything that is in the file."""

from __future__ import annotations

import pickle
import pickletools
import re
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gear.networks.shipped import check_file
from gear.networks.weights import read
from gear.values.errors import GearError

STATES = ("model", "state_dict", "model_state_dict", "model_state", "net", "network", "weights", "params")
"""Under which of these keys a checkpoint holds the network; the rest of it is the optimiser's and the loop's."""

PARALLEL = "module."
"""`DataParallel` puts this before every key."""

_scalar: Any = np.float64(0).__reduce__()[0]
"""What NumPy writes a scalar with, under the names of its older and newer versions."""

PLAIN_GLOBALS: list[Any] = [
    (_scalar, "numpy.core.multiarray.scalar"),
    (_scalar, "numpy._core.multiarray.scalar"),
    np.dtype,
    *(type(np.dtype(code)) for code in ("f2", "f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "?")),
]
"""NumPy's scalars, such as the best figure so far: numbers, which run nothing."""

STATE_DICT_ALONE = "state dict alone (torch.save(model.state_dict(), FILE))"

LOOKED_AT_BYTES = 1 << 20
"""Of a pickle, to say what it wants."""

HARMLESS = ("torch", "collections", "numpy")
"""Packages that checkpoints are made of."""

DEPTH = 3
"""How deep in a checkpoint the network may lie."""


def read_published(path: str | Path) -> dict[str, Tensor]:
    """A network's tensors by key, from a checkpoint of PyTorch's (zip or older) or from a safetensors file.

    Raises:
        GearError: there is no such file, nothing can read it, it wants to run something, or it holds no network.
    """
    file = Path(path)
    check_file(file)
    if file.suffix == ".safetensors":
        state, _ = read(file)
    else:
        state = find_state(_load(file), file)
    if state and all(key.startswith(PARALLEL) for key in state):
        state = {key.removeprefix(PARALLEL): value for key, value in state.items()}
    return state


def find_state(content: Any, path: Path) -> dict[str, Tensor]:
    """The tensors of a checkpoint's network by key: what is nested in it under a customary name, or all of it.

    Raises:
        GearError: it holds none.
    """
    for _ in range(DEPTH):
        if not isinstance(content, Mapping):
            break
        nested = next((content[name] for name in STATES if isinstance(content.get(name), Mapping)), None)
        if nested is None:
            break
        content = nested
    if not isinstance(content, Mapping):
        raise GearError(f"{path}: holds no network, but a {type(content).__name__}; a state dict is wanted")
    tensors = {str(key): value for key, value in content.items() if isinstance(value, Tensor)}
    if not tensors:
        keys = ", ".join(map(str, list(content)[:5])) or "nothing"
        raise GearError(f"{path}: holds no network's tensors (but {keys}); a state dict is wanted")
    return tensors


def _load(path: Path) -> Any:
    """What `torch.load` makes of a file when nothing in it may run.

    Raises:
        GearError: it cannot be read so.
    """
    try:
        with torch.serialization.safe_globals(PLAIN_GLOBALS), warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of pickles in newer protocols, which then load or do not
            return torch.load(path, map_location="cpu", weights_only=True)
    except pickle.UnpicklingError as error:
        found = re.search(r"GLOBAL ([\w.]+)", str(error))
        wanted = found[1] if found else _foreign_global(path)
        if wanted is None:
            # torch's own text suggests to read the file unsafely; only its reason is passed on.
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
    """The first thing that a bare pickle would import and that is not torch's; nothing of the file is run."""
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
