"""JSON as bytes, the same each time."""

from __future__ import annotations

import json

from gear.values.serial import Json


def dump(content: Json) -> bytes:
    """No spaces, keys in the order given, a last newline. NaN is refused, as JSON has none."""
    return (json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False) + "\n").encode()
