"""The folder of an attack: reads finished patches, detects unfinished attacks, and deletes temporary files."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.numpy import load as from_bytes

from gear.collecting.patch_sources import read_patch
from gear.contracts.attacks import Patch, surface_of
from gear.dataset.files import clear_scratch, read_bytes, sha256, write_whole
from gear.dataset.guarded_paths import remove_files, remove_tree
from gear.dataset.json_text import dump_json
from gear.dataset.plan import differences
from gear.dataset.store import check_output
from gear.measuring.patch_checks import is_picture
from gear.measuring.run_log import clear_log
from gear.values.errors import DatasetError, FieldError, OutdatedError, ReplaceableError
from gear.values.regular_file import read_regular
from gear.values.serial import Json, from_json
from gear.verbs.attack.monitor import CHECKPOINT

VERIFY = "verify"
"""Subfolder of the patch folder for the results of `gear attack --verify`."""

NOTES = "attack.json"

BEGUN = "begun.json"
"""File with all inputs of an unfinished attack; the checkpoint contains only their hash."""

FED = {"data", "validation", "calibration", "calibration_samples"}
"""Keys of an attack's plan (all its inputs) that describe the samples; the other keys describe the method."""

EXACT = "patch.safetensors"

NAME = re.compile(r"patch_\d+")

BROKEN = "is gone, damaged or of other patches"

READ_BACK: Any = {
    "steps_done": int, "steps_per_s": float | None, "stopped": str, "gradient_check": dict[str, float] | None,
    "patches": dict[str, str],
}  # fmt: skip
"""Types of the keys of `attack.json`, besides the inputs of the attack, that a later run reads."""


def begin(root: Path, plan: Json, *, force: bool) -> Json | None:
    """Prepares the patch folder of an attack.

    Args:
        root: the patch folder.
        plan: all inputs of the attack, as JSON.
        force: whether patches of another attack are deleted.

    Returns:
        The content of `attack.json` if the folder has finished patches of this attack. Otherwise None, after the plan
        (all inputs of the attack) is written.

    Raises:
        OutdatedError: the folder has finished or unfinished patches of the same method for other samples.
        ReplaceableError: the folder has patches of another attack, or damaged files.
        DatasetError: a file cannot be written.
    """
    check_output(root, "make patches in a folder of their own")
    finished, wanted = root / NOTES, json.loads(json.dumps(plan))
    if force:
        remove_files(root, [NOTES, CHECKPOINT, *(path.name for path in root.glob("patch_*.png"))])
        remove_tree(root, VERIFY)  # results of the rendered check of the deleted patches
        clear_log(root)
    if finished.exists():
        there = _read_notes(finished)
        what = ", ".join(differences({key: there.get(key) for key in wanted}, wanted)[:3])
        if what:
            is_same_way = {key for key in wanted if there.get(key) != wanted[key]} <= FED
            raise (OutdatedError if is_same_way else ReplaceableError)(
                root, f"holds patches that were made with other settings ({what})"
            )
        _check_whole(root, there)
        return there
    if (root / CHECKPOINT).exists():
        _check_begun(root, wanted)
    else:
        write_whole(root, BEGUN, dump_json(plan))
    return None


def read_patches(root: Path) -> tuple[Patch, ...]:
    """Reads the finished patches of a folder with their exact float32 values (`patch.safetensors`).

    Args:
        root: folder of a finished attack.

    Returns:
        The patches in the order of their surfaces.

    Raises:
        ReplaceableError: the file is missing or damaged.
    """
    path = root / EXACT
    try:
        arrays = from_bytes(read_regular(path))
    except (OSError, SafetensorError) as error:
        raise ReplaceableError(path, BROKEN) from error
    if not all(map(is_picture, arrays.values())):
        raise ReplaceableError(path, BROKEN)
    return tuple(Patch(name=name, rgb=arrays[name]) for name in sorted(arrays, key=surface_of))


def tidy(root: Path) -> None:
    """Deletes the files that only an unfinished attack needs: its checkpoint, the note that it has begun, and temporary
    files.

    Args:
        root: folder of the attack.
    """
    remove_files(root, [CHECKPOINT, BEGUN])
    clear_scratch(root)


def _check_begun(root: Path, wanted: Json) -> None:
    """Checks that an unfinished attack in the folder was not begun with the same method on other samples.

    Any other difference is found by `Recorder.resume`, which compares the hash of the plan.

    Raises:
        OutdatedError: the attack in the folder differs only in its samples.
    """
    try:
        there = json.loads(read_bytes(root / BEGUN))
    except (DatasetError, ValueError, RecursionError):
        return
    if not isinstance(there, dict):
        return
    others = {key for key in there.keys() | wanted.keys() if there.get(key) != wanted.get(key)}
    if others and others <= FED:
        what = ", ".join(differences(there, wanted)[:3])
        raise OutdatedError(root, f"holds an unfinished attack from other samples ({what})")


def _read_notes(path: Path) -> Json:
    try:
        there = json.loads(read_bytes(path))
    except (ValueError, RecursionError):
        there = None
    if not isinstance(there, dict):
        raise ReplaceableError(path, BROKEN)
    return there


def _check_whole(root: Path, notes: Json) -> None:
    """Checks that the record has the fields of finished patches, and that the pictures have the recorded hashes.

    Raises:
        ReplaceableError: a field or a picture is missing, or a picture was changed.
    """
    try:
        for key, kind in READ_BACK.items():
            from_json(kind, notes[key], key)
        if notes["gradient_check"] is not None:
            for key in ("predicted_change", "measured_change"):
                from_json(float, notes["gradient_check"][key], key)
        if notes.get("achieved") is not None:  # older folders have none
            from_json(dict[str, dict[str, float | None] | None], notes["achieved"], "achieved")
    except (KeyError, FieldError) as error:
        raise ReplaceableError(root / NOTES, BROKEN) from error
    for name, digest in notes["patches"].items():
        path = root / f"{name}.png"
        if not NAME.fullmatch(name):  # the name could be a path outside the folder
            raise ReplaceableError(root / NOTES, BROKEN)
        if not path.is_file() or sha256(read_patch(path).tobytes()) != digest:
            raise ReplaceableError(path, BROKEN)
    if {patch.name for patch in read_patches(root)} != notes["patches"].keys():
        raise ReplaceableError(root / EXACT, BROKEN)
