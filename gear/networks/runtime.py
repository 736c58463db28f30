"""Settings of CPU and GPU: memory allocator, threads, devices, precision, and seeds of random weights."""

from __future__ import annotations

import contextlib
import ctypes
import functools
import sys
from collections.abc import Iterator
from typing import Literal

import numpy as np
import torch

from gear.values.errors import GearError
from gear.values.frames import UInt8Image
from gear.values.machine import cores

M_TRIM_THRESHOLD, M_TOP_PAD, M_MMAP_MAX = -1, -2, -4
TOP_PAD_BYTES = 256 << 20


@functools.cache
def prepare(threads: int = 0) -> None:
    """Sets the memory allocator and the number of threads; further calls in a process do nothing.

    By default glibc returns the memory of large activations to the kernel after every step and requests it again. With
    this setting glibc keeps that memory, which makes a step of an attack up to twice as fast. Results do not change. On
    systems without glibc the allocator is not touched.

    Args:
        threads: number of torch's threads; 0 for torch's own choice (`OMP_NUM_THREADS`, or an earlier setting), but at
            most one for each core that this process may use.
    """
    torch.set_num_threads(threads or min(torch.get_num_threads(), cores()))
    if not sys.platform.startswith("linux"):
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(M_MMAP_MAX, 0)
        mallopt(M_TRIM_THRESHOLD, 2**31 - 1)
        mallopt(M_TOP_PAD, TOP_PAD_BYTES)


def device_of(requested: Literal["auto", "cpu", "cuda"]) -> torch.device:
    """The torch device that the option `device` names: `auto` is a GPU if there is one, otherwise the CPU.

    Args:
        requested: value of the option.

    Raises:
        GearError: the machine has no such device.
    """
    if requested == "cuda" and not torch.cuda.is_available():
        raise GearError("device cuda: torch sees no GPU here; use device=auto or device=cpu")
    if requested == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    return torch.device(requested)


def has_cuda(requested: str | None) -> bool:
    """Returns whether networks run on a GPU of this machine.

    Args:
        requested: value of the option `device`; None is `auto`.
    """
    return requested != "cpu" and torch.cuda.is_available()


def supports_bfloat16(device: torch.device) -> bool:
    """Returns whether a device has instructions for bfloat16. On a device without them, bfloat16 is slower than
    float32.

    Args:
        device: torch device.
    """
    if device.type == "cuda":
        return bool(torch.cuda.is_bf16_supported(including_emulation=False))
    known = ("_is_avx512_bf16_supported", "_is_amx_tile_supported")
    return device.type == "cpu" and any(bool(getattr(torch.cpu, name, bool)()) for name in known)


def autocast(device: torch.device, precision: Literal["auto", "float32", "bfloat16"]) -> torch.autocast:
    """Returns a context in which suitable operations of a network run in a precision.

    Args:
        device: torch device of the network.
        precision: `bfloat16` for half precision; with `float32` and `auto` the context changes nothing.
    """
    return torch.autocast(device.type, torch.bfloat16, enabled=precision == "bfloat16")


@contextlib.contextmanager
def seeded(seed: int) -> Iterator[None]:
    """A context in which layers draw their initial weights with a seed.

    Afterwards torch's random generators have the state that they had before.

    Args:
        seed: the seed, -2^63 to 2^64 - 1.

    Raises:
        GearError: torch does not accept the seed.
    """
    if not -(2**63) <= seed < 2**64:
        raise GearError(f"seed {seed} is beyond what torch takes (-2^63 to 2^64 - 1); take a smaller one")
    with torch.random.fork_rng(devices=range(torch.cuda.device_count())):
        torch.manual_seed(seed)
        yield


def as_bytes(pictures: torch.Tensor) -> UInt8Image:
    """Converts one picture, (3, H, W) in 0..1, to (H, W, 3) uint8, or a batch, (B, 3, H, W), to (B, H, W, 3).

    Values beyond the range are clipped.
    """
    levels = (pictures.detach().clamp(0, 1) * 255).round().to(torch.uint8)
    return np.ascontiguousarray(levels.movedim(-3, -1).cpu().numpy())
