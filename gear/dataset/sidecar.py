"""Sidecars as JSON text."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

from gear.contracts.tasks import Auxiliary, Sidecar
from gear.dataset.files import read_bytes
from gear.dataset.sidecar_validation import check_numbers, check_sidecar
from gear.values.errors import DatasetError, FieldError
from gear.values.ground_truth import SurfaceTruth
from gear.values.scene import SceneRecord
from gear.values.serial import Json, from_json, to_json


def dump_json(value: Json) -> bytes:
    """JSON as gear writes it: one key a line, keys in the order given, a newline at the end."""
    return (json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()


def load_json(path: Path) -> Json:
    """Reads a JSON file of a dataset.

    Raises:
        DatasetError: it is missing or not JSON, as `parse_json` has it.
    """
    data = read_bytes(path)
    try:
        return parse_json(data)
    except (ValueError, RecursionError) as error:  # brackets in brackets, too
        raise DatasetError(path, f"is not JSON ({error}); delete it and run the same collection again") from error


def parse_json(data: bytes | str) -> Json:
    """What JSON says.

    Raises:
        ValueError, RecursionError: it is none, or says what `dump_json` never does: numbers that are not finite, or
            half characters, with which nothing that prints, draws or names files can do anything.
    """
    value = json.loads(data, parse_constant=_no_number, parse_float=_number, parse_int=_integer)
    text = data if isinstance(data, str) else data.decode("latin-1")
    if "\\ud" in text or "\\uD" in text:
        json.dumps(value, ensure_ascii=False).encode()
    return value


def _no_number(word: str) -> Json:
    """What Python's reader takes beyond JSON.

    Raises:
        ValueError: always.
    """
    raise ValueError(f"{word} is no number of JSON")


def _number(text: str) -> float:
    """Raises:
    ValueError: it is too large for one, and would be infinite.
    """
    value = float(text)
    if math.isinf(value):
        raise ValueError(f"{text[:20]} is too large a number")
    return value


def _integer(text: str) -> int:
    """Raises:
    ValueError: it is too large to be reckoned with beside fractions.
    """
    if len(text) > sys.float_info.max_10_exp:
        raise ValueError(f"{text[:20]}… is too large a number")
    return int(text)


def sidecar_bytes(sidecar: Sidecar) -> bytes:
    """As written beside a sample. Auxiliary files are only spoken of where there are any."""
    content = {
        "record": to_json(sidecar.record),
        "surfaces": to_json(sidecar.surfaces),
        "facts": sidecar.facts,
        "files": dict(sidecar.files),
    }
    if sidecar.auxiliary:
        content["auxiliary"] = to_json(dict(sidecar.auxiliary))
    return dump_json(content)


def read_sidecar(path: Path) -> Sidecar:
    """Reads a sidecar back.

    Raises:
        DatasetError: it is missing, broken, of another version of gear, or cannot be true.
    """
    data = load_json(path)
    try:
        for part in ("record", "surfaces"):
            check_numbers(data[part], part)
        sidecar = Sidecar(
            record=from_json(SceneRecord, data["record"], "record"),
            surfaces=from_json(tuple[SurfaceTruth, ...], data["surfaces"], "surfaces"),
            facts=data["facts"],
            files=from_json(dict[str, str], data["files"], "files"),
            auxiliary=from_json(dict[str, Auxiliary], data.get("auxiliary", {}), "auxiliary"),
        )
        check_sidecar(sidecar)
        if path.stem.isdecimal() and int(path.stem) != sidecar.record.index:  # it would bear another one's pictures
            raise FieldError("record.index", f"is {sidecar.record.index}, the file's name says {int(path.stem)}")
    except (KeyError, TypeError, FieldError) as error:
        raise no_sidecar(path, error) from error
    return sidecar


def no_sidecar(path: Path, error: Exception) -> DatasetError:
    """What to say of one that cannot be read."""
    said = f"{error} is missing" if isinstance(error, KeyError) else str(error)
    return DatasetError(
        path, f"is not a sidecar of this version of gear ({said}); delete it and run the same collection again"
    )
