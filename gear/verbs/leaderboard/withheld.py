"""Withheld scenes: a seed and places that the maintainers of a leaderboard keep secret, and commit to by a salted hash.

The hash is published when a benchmark begins. Nobody can compute the seed or the places from it, and the maintainers
cannot exchange them later (a commitment scheme: Blum, "Coin flipping by telephone", 1981).
"""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import dataclass
from pathlib import Path

from gear.dataset.json_text import load_json
from gear.leaderboard.record import canonical
from gear.values.errors import DatasetError, FieldError, GearError
from gear.values.serial import Json, from_json, to_json

SALT = re.compile(r"[0-9a-f]{32,128}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Withheld:
    """A secret seed and, optionally, secret places.

    Attributes:
        salt: 32 to 128 random hexadecimal digits, without which seeds could be guessed from the hash.
        seed: seed of the pictures.
        places: names of scenes by town; empty for the places of the benchmark.
    """

    salt: str
    seed: int
    places: dict[str, tuple[str, ...]]

    def __post_init__(self) -> None:
        if not SALT.fullmatch(self.salt):
            raise FieldError("salt", "must be 32 to 128 hexadecimal digits, for example of `openssl rand -hex 32`")
        if not 0 <= self.seed < 1 << 31:
            raise FieldError("seed", f"must be 0 to {(1 << 31) - 1}")

    @property
    def commitment(self) -> str:
        """The salted hash that is published."""
        return hashlib.sha256(canonical(to_json(self))).hexdigest()

    @property
    def places_setting(self) -> str:
        """The places as a `KEY=VALUE` text for a bench config."""
        return f"places={json.dumps({town: list(scenes) for town, scenes in self.places.items()})}"


def read_withheld(path: Path, commitment: str | None = None) -> Withheld:
    """Reads a file with withheld scenes, and compares it with the published hash.

    Args:
        path: the JSON file.
        commitment: the published salted hash; None if it is not to be compared.

    Raises:
        DatasetError: the file cannot be read, or is not of this form.
        GearError: the file is not the one that the hash was computed from.
    """
    content: Json = load_json(path)
    try:
        found: Withheld = from_json(Withheld, content)
    except FieldError as error:
        raise DatasetError(path, f"is no file of withheld scenes ({error})") from error
    if commitment is not None and found.commitment != commitment:
        raise GearError(f"{path}: its salted hash is {found.commitment}, not the published {commitment[:64]}")
    return found
