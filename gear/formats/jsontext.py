"""JSON as bytes; the same value always gives the same bytes."""

from __future__ import annotations

import json

from gear.values.serial import Json


def dump(content: Json) -> bytes:
    """Encodes a value without spaces, with keys in the given order and a final newline. NaN is refused, because JSON
    lacks it.
    """
    return (json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False) + "\n").encode()
