"""Sidecars as JSON text."""

from __future__ import annotations

import json
from pathlib import Path

from gear.contracts.tasks import Auxiliary, Sidecar
from gear.dataset.files import read_bytes
from gear.values.errors import DatasetError, FieldError
from gear.values.scene import SceneRecord
from gear.values.serial import Json, from_json, to_json
from gear.values.truth import SurfaceTruth


def dump_json(value: Json) -> bytes:
    """JSON as gear writes it: one key a line, keys in the order given, a newline at the end."""
    return (json.dumps(value, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()


def load_json(path: Path) -> Json:
    """Reads a JSON file of a dataset.

    Raises:
        DatasetError: it is missing or not JSON.
    """
    try:
        return json.loads(read_bytes(path), parse_constant=_no_number)
    except (ValueError, RecursionError) as error:  # brackets in brackets, too
        raise DatasetError(path, f"is not JSON ({error}); delete it and run the same collection again") from error


def _no_number(word: str) -> Json:
    """`dump_json` never writes what Python's reader takes beyond JSON, and nothing that draws or measures expects it.

    Raises:
        ValueError: always.
    """
    raise ValueError(f"{word} is no number of JSON")


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
        DatasetError: it is missing, broken, or of another version of gear.
    """
    data = load_json(path)
    try:
        return Sidecar(
            record=from_json(SceneRecord, data["record"], "record"),
            surfaces=from_json(tuple[SurfaceTruth, ...], data["surfaces"], "surfaces"),
            facts=data["facts"],
            files=from_json(dict[str, str], data["files"], "files"),
            auxiliary=from_json(dict[str, Auxiliary], data.get("auxiliary", {}), "auxiliary"),
        )
    except (KeyError, TypeError, FieldError) as error:
        raise DatasetError(path, f"is not a sidecar of this version of gear: {error}") from error
