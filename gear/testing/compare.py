"""Comparison of nested values with arrays, such as samples, for which `==` does not work."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np


def difference(a: Any, b: Any, where: str = "value") -> str:
    """Describes the first difference between two nested values; "" if they are equal.

    Arrays are equal if shape, dtype and all elements are equal, where NaN equals NaN.

    Args:
        a, b: dataclasses, mappings, sequences, arrays or plain values.
        where: name of the values in the description.
    """
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return _array_difference(np.asarray(a), np.asarray(b), where)
    if dataclasses.is_dataclass(a) and not isinstance(a, type):
        if type(a) is not type(b):
            return f"{where}: {type(a).__name__} is not {type(b).__name__}"
        names = [field.name for field in dataclasses.fields(a)]
        return _first((getattr(a, name), getattr(b, name), f"{where}.{name}") for name in names)
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        if a.keys() != b.keys():
            return f"{where}: keys {sorted(a)} are not {sorted(b)}"
        return _first((a[key], b[key], f"{where}[{key!r}]") for key in a)
    if isinstance(a, (tuple, list)) and isinstance(b, (tuple, list)):
        if len(a) != len(b):
            return f"{where}: {len(a)} items are not {len(b)}"
        return _first((x, y, f"{where}[{i}]") for i, (x, y) in enumerate(zip(a, b, strict=True)))
    return "" if a == b or (a != a and b != b) else f"{where}: {a!r} is not {b!r}"


def share_apart(a: Any, b: Any, tolerance: float) -> float:
    """The share, 0..1, of the numbers in `a` that differ from `b` by more than a relative tolerance; NaN equals
    NaN.

    The tolerance is a fraction of the largest number of the array in `b`. For containers the result is the largest
    share among their items; it is 1 if shapes, types, names or counts differ.

    Args:
        a, b: dataclasses, mappings, sequences, arrays or plain values.
        tolerance: largest difference that counts as equal, as a fraction.
    """
    if dataclasses.is_dataclass(a) and type(a) is type(b):
        names = [field.name for field in dataclasses.fields(a)]
        return max((share_apart(getattr(a, name), getattr(b, name), tolerance) for name in names), default=0.0)
    if isinstance(a, Mapping) and isinstance(b, Mapping) and a.keys() == b.keys():
        return max((share_apart(a[key], b[key], tolerance) for key in a), default=0.0)
    if isinstance(a, (tuple, list)) and isinstance(b, (tuple, list)) and len(a) == len(b):
        return max((share_apart(x, y, tolerance) for x, y in zip(a, b, strict=True)), default=0.0)
    if isinstance(a, (Mapping, tuple, list)) or isinstance(b, (Mapping, tuple, list)):
        return 1.0
    x, y = np.asarray(a), np.asarray(b)
    if x.shape != y.shape or x.dtype != y.dtype or not np.issubdtype(x.dtype, np.number):
        return float(bool(difference(a, b)))
    is_near = np.isclose(x, y, rtol=0, atol=tolerance * float(np.nanmax(np.abs(y), initial=0)), equal_nan=True)
    return 1 - float(is_near.mean()) if is_near.size else 0.0


def freeze(value: Any) -> Any:
    """Makes all arrays inside a value read-only, in place, and returns the value.

    Args:
        value: dataclass, mapping, sequence, array or plain value.
    """
    if isinstance(value, np.ndarray):
        value.setflags(write=False)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        for field in dataclasses.fields(value):
            freeze(getattr(value, field.name))
    elif isinstance(value, Mapping):
        for item in value.values():
            freeze(item)
    elif isinstance(value, (tuple, list)):
        for item in value:
            freeze(item)
    return value


def _first(triples: Any) -> str:
    return next((text for a, b, where in triples if (text := difference(a, b, where))), "")


def _array_difference(a: np.ndarray, b: np.ndarray, where: str) -> str:
    if a.shape != b.shape or a.dtype != b.dtype:
        return f"{where}: {a.shape} of {a.dtype} is not {b.shape} of {b.dtype}"
    equal = (a == b) | ((a != a) & (b != b))
    return "" if equal.all() else f"{where}: {int((~equal).sum())} of {equal.size} elements differ"
