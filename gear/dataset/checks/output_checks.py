"""Checks the return values of a task's or an evaluator's methods before they are used."""

from __future__ import annotations

import json
from collections.abc import Mapping
from numbers import Real
from typing import Any

import numpy as np

from gear.contracts.tasks import Encoded
from gear.values.frames import UInt8Image


def check_encoded(encoded: Any, method: str) -> Encoded:
    """Checks that a method of a task returned files as bytes and metadata as JSON, and returns its value.

    Args:
        encoded: value that the method returned.
        method: name of the method, for the error message.

    Raises:
        TypeError: the value is not an `Encoded`, a file in it is not bytes, or its metadata hold values that JSON
            cannot represent.
        ValueError: the metadata hold numbers that JSON cannot represent.
    """
    if not isinstance(encoded, Encoded):
        raise TypeError(f"{method} must give an Encoded, got {type(encoded).__name__}")
    for path, data in encoded.files.items():
        if not isinstance(data, bytes):
            raise TypeError(f"{method}: file {path!r} must be bytes, got {type(data).__name__}")
    try:
        json.dumps(encoded.facts, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise type(error)(f"{method}: facts must be JSON: {error}") from error
    return encoded


def check_previews(previews: Any) -> dict[str, UInt8Image]:
    """Checks the return value of a task's `preview` and returns it as a dictionary of (H, W, 3) uint8 pictures.

    Raises:
        TypeError: the value is not a mapping, or a picture in it is not (H, W, 3) uint8.
        ValueError: the value cannot be read as a mapping.
    """
    pictures = dict(previews)
    for name, pixels in pictures.items():
        good = isinstance(pixels, np.ndarray) and pixels.dtype == np.uint8 and pixels.ndim == 3
        if not (good and pixels.shape[2] == 3 and pixels.size):
            got = f"{pixels.dtype} {pixels.shape}" if isinstance(pixels, np.ndarray) else type(pixels).__name__
            raise TypeError(f"preview {name!r} is no (H, W, 3) uint8 picture but {got}")
    return {str(name): pixels for name, pixels in pictures.items()}


def check_metrics(metrics: Any, method: str) -> dict[str, float]:
    """Checks the return value of an evaluator's `method` and returns it as a dictionary.

    Args:
        metrics: value that the method returned.
        method: name of the method, for the error message.

    Raises:
        TypeError: the value is not a mapping of names to numbers.
    """
    if not isinstance(metrics, Mapping):
        raise TypeError(f"{method} must give metrics by name, got {type(metrics).__name__}")
    for name, value in metrics.items():
        if not isinstance(name, str) or not isinstance(value, Real):
            raise TypeError(f"{method}: metric {name!r} must be a number, got {type(value).__name__}")
    return dict(metrics)
