"""Encodes and reads sidecars, the JSON files with scene, surfaces and file hashes of each sample."""

from __future__ import annotations

from pathlib import Path

from gear.contracts.tasks import Auxiliary, Sidecar
from gear.dataset.checks.sidecar_validation import check_numbers, check_sidecar
from gear.dataset.sealed_json import load_sealed, sealed_json
from gear.values.errors import DatasetError, FieldError
from gear.values.ground_truth import SurfaceTruth
from gear.values.scene import SceneRecord
from gear.values.serial import from_json, to_json


def sidecar_bytes(sidecar: Sidecar) -> bytes:
    """Encodes a sidecar as JSON with a hash of its own content; `auxiliary` and `device` are left out if they
    are empty.
    """
    content = {
        "record": to_json(sidecar.record),
        "surfaces": to_json(sidecar.surfaces),
        "facts": sidecar.facts,
        "files": dict(sidecar.files),
    }
    if sidecar.auxiliary:
        content["auxiliary"] = to_json(dict(sidecar.auxiliary))
    if sidecar.device:
        content["device"] = dict(sidecar.device)
    return sealed_json(content)


def read_sidecar(path: Path) -> Sidecar:
    """Reads a sidecar, the JSON file of one sample, and checks its values.

    Args:
        path: the file `<index>.json`; its name must be the index in its scene record.

    Raises:
        DatasetError: the sidecar is missing, damaged, of another version of gear, or holds impossible values.
    """
    data = load_sealed(path)
    try:
        for part in ("record", "surfaces"):
            check_numbers(data[part], part)
        sidecar = Sidecar(
            record=from_json(SceneRecord, data["record"], "record"),
            surfaces=from_json(tuple[SurfaceTruth, ...], data["surfaces"], "surfaces"),
            facts=data["facts"],
            files=from_json(dict[str, str], data["files"], "files"),
            auxiliary=from_json(dict[str, Auxiliary], data.get("auxiliary", {}), "auxiliary"),
            device=from_json(dict[str, str], data.get("device", {}), "device"),
        )
        check_sidecar(sidecar)
        if (
            path.stem.isdecimal() and int(path.stem) != sidecar.record.index
        ):  # else two samples would have the same pictures
            raise FieldError("record.index", f"is {sidecar.record.index}, the file's name says {int(path.stem)}")
    except (KeyError, TypeError, FieldError) as error:
        raise no_sidecar(path, error) from error
    return sidecar


def no_sidecar(path: Path, error: Exception) -> DatasetError:
    """Makes the error for a sidecar (the JSON file of a sample) that cannot be read.

    Args:
        path: the file.
        error: why its content cannot be used: a missing key, or a value of a wrong type.
    """
    said = f"{error} is missing" if isinstance(error, KeyError) else str(error)
    remedy = "delete it and run the same collection again"
    return DatasetError(path, f"is not a sidecar of this version of gear ({said}); {remedy}")
