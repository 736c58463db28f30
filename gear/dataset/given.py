"""What a task gives to be written, held to its contract before a byte of it is."""

from __future__ import annotations

import json
from typing import Any

from gear.contracts.tasks import Encoded


def check_encoded(given: Any, method: str) -> Encoded:
    """Takes what `method` of a task returned, and gives it back.

    Raises:
        TypeError: it is no `Encoded`, a file in it is not bytes, or its facts hold what JSON has no word for.
        ValueError: its facts hold numbers that JSON has no word for.
    """
    if not isinstance(given, Encoded):
        raise TypeError(f"{method} must give an Encoded, got {type(given).__name__}")
    for path, data in given.files.items():
        if not isinstance(data, bytes):
            raise TypeError(f"{method}: file {path!r} must be bytes, got {type(data).__name__}")
    try:
        json.dumps(given.facts, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise type(error)(f"{method}: facts must be JSON: {error}") from error
    return given
