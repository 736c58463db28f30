"""Reads published weights files without running code that a file may contain."""

from __future__ import annotations

import argparse
import pickle
import pickletools
import re
import sys
import types
import warnings
from collections import OrderedDict
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

PLAIN_MODULES = {"collections", "datetime", "decimal", "enum", "fractions", "typing", "uuid"}
"""Modules of the standard library whose classes are left out of a checkpoint, like those of other packages."""

PLAIN_BUILTINS = {"bool", "bytearray", "complex", "dict", "float", "frozenset", "int", "list", "range", "set", "slice",
                  "str", "tuple"}  # fmt: skip
"""Classes of `builtins` that are left out in the same way."""

REFUSED_PACKAGES = {"torch", "numpy", "__builtin__", "copy_reg"}
"""Packages besides the standard library that are not left out: a whole network pickled by torch would lack its
tensors, and the last two are Python 2's names of modules of the standard library.
"""

MOST_LEFT_OUT = 100
"""Largest number of classes that are left out of one checkpoint."""

DAMAGE = (RuntimeError, EOFError, ValueError, OSError, KeyError, AttributeError, IndexError, TypeError)
"""Errors with which torch fails on a damaged file, or on one of another program."""

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


class _LeftOut:
    """Stands for a class that a checkpoint names, so that the class is neither imported nor run.

    Its objects are ordinary dictionaries: torch fills no others, and a state dict of such a class is then readable.
    """

    def __new__(cls, *args: object, **kwargs: object) -> Any:
        """A new, empty dictionary.

        Args:
            args, kwargs: arguments in the file, which are not used.
        """
        return OrderedDict()


def _is_left_out(name: str) -> bool:
    """Whether a class that a checkpoint names is left out, instead of the file being refused.

    Nothing in the file is run in either case. A file that names functions of the standard library is refused, because
    it may have been made to harm programs that read it unsafely.

    Args:
        name: module and name, such as `omegaconf.dictconfig.DictConfig`.
    """
    package, _, rest = name.partition(".")
    if package == "builtins":
        return rest in PLAIN_BUILTINS
    is_foreign = package not in sys.stdlib_module_names and package not in REFUSED_PACKAGES
    return is_foreign or package in PLAIN_MODULES


def _load(path: Path) -> Any:
    """The content of a file, read by `torch.load` with `weights_only`, so that none of it is run.

    Objects of classes of other packages, such as a configuration beside the weights, are left out.

    Raises:
        GearError: the file cannot be read in this way.
    """
    left_out: dict[str, type] = {}
    while True:
        try:
            allowed = [*PLAIN_GLOBALS, *((stand_in, name) for name, stand_in in left_out.items())]
            with torch.serialization.safe_globals(allowed), warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # torch warns of newer pickle protocols
                return torch.load(path, map_location="cpu", weights_only=True)
        except Exception as error:
            name = _named_class(error, path)
            if name is None or name in left_out or len(left_out) >= MOST_LEFT_OUT or not _is_left_out(name):
                raise _refusal(error, path) from error
            left_out[name] = type(name, (_LeftOut,), {})


def _named_class(error: Exception, path: Path) -> str | None:
    """The class or function because of which torch did not read a file; None if there was another reason."""
    if not isinstance(error, pickle.UnpicklingError):
        return None
    found = re.search(r"GLOBAL ([\w.]+)", str(error))
    if found is None:
        return _foreign_global(path)
    return found[1] if "." in found[1] else f"builtins.{found[1]}"


def _refusal(error: Exception, path: Path) -> GearError:
    """The error about a checkpoint that cannot be read, as one line.

    Args:
        error: the error of torch; one that no damaged or foreign file causes is raised again.
        path: the file.
    """
    if isinstance(error, pickle.UnpicklingError):
        wanted = _named_class(error, path)
        if wanted is None:
            # torch's message suggests reading the file unsafely, so only the reason is taken from it.
            reason = re.search(r"WeightsUnpickler error: *(\S.*)", str(error))
            why = reason[1] if reason else "it is no plain pickle of tensors"
            return GearError(f"{path}: not a checkpoint that can be read safely ({why})")
        return GearError(
            f"{path}: refused, because reading it would run {wanted}; have somebody who trusts the file save its "
            f"{STATE_DICT_ALONE}, or get it as safetensors"
        )
    if "TorchScript" in str(error):
        return GearError(
            f"{path}: refused, because it is a TorchScript archive, which holds code; have somebody who trusts it "
            f"save its {STATE_DICT_ALONE}"
        )
    if not isinstance(error, DAMAGE):
        raise error
    # Some of torch's messages suggest reading the file unsafely.
    cause = type(error).__name__ if "weights_only" in str(error) else _first_line(error)
    return GearError(f"{path}: not a checkpoint of PyTorch's ({cause})")


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
