"""Checks of the values in records, which come from strangers."""

from __future__ import annotations

import math
import re

from gear.values.errors import FieldError
from gear.values.serial import Json

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+ -]{0,79}")
"""Pattern of names in records; such names are safe in file names."""

SHA256 = re.compile(r"[0-9a-f]{64}")

PLUGIN_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*(/[a-z][a-z0-9_]*)?")
"""Pattern of a plugin's name, which may be preceded by its package."""

LONGEST_TEXT = 300


def check_name(field: str, text: str) -> None:
    """Checks that the value `text` of the entry `field` of a record is a plain name.

    Raises:
        FieldError: the text is no plain name, for example because it holds a path.
    """
    if not NAME.fullmatch(text):
        raise FieldError(field, f"{text[:40]!r} is no plain name (letters, digits, `_`, `.`, `+`, `-`, spaces)")


def check_plugin_name(field: str, text: str) -> None:
    """Checks that the value `text` of the entry `field` of a record can be the name of a plugin.

    Raises:
        FieldError: the text is no name of a plugin.
    """
    if len(text) > LONGEST_TEXT or not PLUGIN_NAME.fullmatch(text):
        raise FieldError(field, f"{text[:40]!r} is no name of a plugin")


def check_text(field: str, text: str) -> None:
    """Checks that the value `text` of the entry `field` of a record is a short printable text.

    Raises:
        FieldError: the text is too long or holds characters that cannot be printed.
    """
    if len(text) > LONGEST_TEXT or not (text.isprintable() or not text):
        raise FieldError(field, f"is longer than {LONGEST_TEXT} characters, or not printable")


def check_sha256(field: str, text: str) -> None:
    """Checks that the value `text` of the entry `field` of a record has the form of a SHA-256.

    Raises:
        FieldError: the text is not 64 hexadecimal digits.
    """
    if not SHA256.fullmatch(text):
        raise FieldError(field, "is no SHA-256 (64 hexadecimal digits in lower case)")


def check_number(field: str, value: float, *, low: float, high: float) -> None:
    """Checks that the value of the entry `field` of a record is a finite number from `low` to `high`, both included.

    Raises:
        FieldError: the number is not finite or out of range.
    """
    if not math.isfinite(value) or not low <= value <= high:
        raise FieldError(field, f"must be {low:g} to {high:g}")


def check_plain(field: str, value: Json, depth: int = 0) -> None:
    """Checks that a config holds no paths and nothing enormous.

    Only the names of plugins (keys `plugin`, and the names of tasks) may contain a slash.

    Args:
        field: name of the entry of the record, for the error message.
        value: the config as JSON.
        depth: number of levels above `value`; at most 12.

    Raises:
        FieldError: a text is a path, too long or not printable; a number is enormous; or lists lie too deep.
    """
    if depth > 12:
        raise FieldError(field, "has too many levels")
    if isinstance(value, dict):
        if len(value) > 200:
            raise FieldError(field, "has more than 200 keys")
        for key, inner in value.items():
            if key == "plugin" and isinstance(inner, str) and (not inner or PLUGIN_NAME.fullmatch(inner)):
                continue
            if not PLUGIN_NAME.fullmatch(key) and not _is_plain(key):
                raise FieldError(field, f"{key[:40]!r} is no plain key")
            check_plain(f"{field}.{key}", inner, depth + 1)
    elif isinstance(value, list):
        if len(value) > 1000:
            raise FieldError(field, "has more than 1000 entries")
        for inner in value:
            check_plain(field, inner, depth + 1)
    elif isinstance(value, str):
        if not _is_plain(value):
            raise FieldError(
                field, f"{value[:40]!r} is a path or no plain text; a record names only what packages bring"
            )
    elif isinstance(value, (int, float)) and abs(value) > 1e9:
        raise FieldError(field, "is an enormous number")


def _is_plain(text: str) -> bool:
    is_safe = not any(mark in text for mark in ("/", "\\", "~", "..")) and (text.isprintable() or not text)
    return is_safe and len(text) <= LONGEST_TEXT
