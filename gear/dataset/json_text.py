"""Writes and reads JSON text; numbers that are not finite and invalid Unicode (lone surrogates) are refused."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

from gear.dataset.files import read_bytes
from gear.values.errors import DatasetError
from gear.values.serial import Json


def dump_json(value: Json) -> bytes:
    """Encodes a value as UTF-8 JSON text with one key per line, keys in the given order, and a final newline."""
    return (json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()


def load_json(path: Path) -> Json:
    """Reads the JSON file `path`.

    Raises:
        DatasetError: the file is missing, is not JSON, or holds values that gear never writes (see `parse_json`).
    """
    data = read_bytes(path)
    try:
        return parse_json(data)
    except (ValueError, RecursionError) as error:  # brackets in brackets, too
        raise DatasetError(path, f"is not JSON ({error}); delete it and run the same collection again") from error


def parse_json(data: bytes | str) -> Json:
    """Parses JSON text.

    Args:
        data: the text, or its UTF-8 bytes.

    Raises:
        ValueError, RecursionError: the text is not JSON, or holds values that `dump_json` never writes: numbers that
            are not finite, or lone surrogates, which cannot be printed, drawn or used in file names.
    """
    value = json.loads(data, parse_constant=_no_number, parse_float=_number, parse_int=_integer)
    text = data if isinstance(data, str) else data.decode("latin-1")
    if "\\ud" in text or "\\uD" in text:
        json.dumps(value, ensure_ascii=False).encode()
    return value


def _no_number(word: str) -> Json:
    """Refuses the words for numbers (NaN, Infinity) that Python's reader accepts beyond JSON.

    Raises:
        ValueError: always.
    """
    raise ValueError(f"{word} is no number of JSON")


def _number(text: str) -> float:
    """Raises:
    ValueError: the number is too large for a float, and would be infinite.
    """
    value = float(text)
    if math.isinf(value):
        raise ValueError(f"{text[:20]} is too large a number")
    return value


def _integer(text: str) -> int:
    """Raises:
    ValueError: the number is too large to be combined with floats.
    """
    if len(text) > sys.float_info.max_10_exp:
        raise ValueError(f"{text[:20]}… is too large a number")
    return int(text)
