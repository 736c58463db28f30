"""Encodes JSON as bytes; the same value always gives the same bytes."""

from __future__ import annotations

import json

from gear.values.serial import Json


def dump(content: Json) -> bytes:
    """Encodes a value as compact JSON with keys in the given order and a final newline.

    NaN raises an error, because JSON has no NaN.

    Args:
        content: the JSON value.

    Raises:
        ValueError: the value contains NaN or an infinite number.
    """
    return (json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False) + "\n").encode()
