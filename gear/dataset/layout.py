"""The paths of gear's own files in a dataset: all are in the folder `gear`, with one folder per split."""

from __future__ import annotations

from pathlib import PurePosixPath

GEAR = "gear"

CARD, CROISSANT = "README.md", "croissant.json"
CARDS = (CARD, CROISSANT)
"""The files in the root that describe the dataset."""

PROBES, SCANS, FLOWS = "probes", "scans", "flow"
"""Kinds of auxiliary files of a sample."""

TEMPORARY = ("begun", "claims", "failed")
"""Folders of a split for files that exist only while the split is made."""


def split_folder(split: str) -> str:
    """The folder of a split's sidecars (JSON files of the samples), plan and manifest, relative to the dataset's
    root.
    """
    return f"{GEAR}/{split}"


def sidecar_path(split: str, index: int) -> str:
    """The path of a sample's sidecar, a JSON file with the scene, the surfaces and the hashes of the sample's
    files.

    The sidecar is written last, so a sample that has a sidecar is complete.

    Args:
        split: name of the split.
        index: index of the sample.
    """
    return f"{split_folder(split)}/samples/{index:06d}.json"


def auxiliary_path(split: str, kind: str, index: int, name: str) -> str:
    """The path of an additional file of a sample; `kind` is its folder, such as `probes` or `scans`.

    Args:
        split: name of the split.
        kind: folder of the file, such as `probes` or `scans`.
        index: index of the sample.
        name: name of the file after the index.
    """
    return f"{split_folder(split)}/{kind}/{index:06d}_{name}"


def is_reserved(relative: str, split: str) -> bool:
    """Whether no sample of a split can have a file of that path: a card, or a file below `gear/` that is no auxiliary
    file of the split. Letters that differ only in case are equal, as they are for some file systems.

    Args:
        relative: path relative to the root of the dataset, with slashes.
        split: name of the split.
    """
    parts = PurePosixPath(relative.casefold()).parts
    if parts[:1] != (GEAR,):
        return "/".join(parts) in {card.casefold() for card in CARDS}
    return len(parts) != 4 or parts[1] != split.casefold() or parts[2] not in (PROBES, SCANS, FLOWS)


def is_temporary(relative: str) -> bool:
    """Whether a path relative to the root is a file that exists only while a split is made: a half-written file, a list
    of files, a claim or a note on a failure.
    """
    parts = PurePosixPath(relative).parts
    return parts[0] == GEAR and (parts[1:2] == ("scratch",) or (len(parts) == 4 and parts[2] in TEMPORARY))


def plan_path(split: str) -> str:
    """The path of a split's plan, a JSON file with everything that decides the bytes of the split; it is written
    first.
    """
    return f"{split_folder(split)}/plan.json"


def begun_path(split: str, what: str) -> str:
    """The path of a JSON list of files that are being written; it is deleted when all of them are complete, so after an
    interruption it names the incomplete files.

    Args:
        split: name of the split.
        what: index of a sample with 6 digits, or `indexes` for the index files of the split.
    """
    return f"{split_folder(split)}/begun/{what}.json"


def claim_path(split: str, index: int) -> str:
    """The path of the claim on a sample, a locked file that exists while a run makes the sample.

    Args:
        split: name of the split.
        index: index of the sample.
    """
    return f"{split_folder(split)}/claims/{index:06d}.claim"


def failed_path(split: str, index: int) -> str:
    """The path of the note on a sample that could not be made; the note is deleted when the sample is made.

    Args:
        split: name of the split.
        index: index of the sample.
    """
    return f"{split_folder(split)}/failed/{index:06d}.json"


def manifest_path(split: str) -> str:
    """The path of a split's manifest, a JSON file that lists all files of the finished split; it is written last."""
    return f"{split_folder(split)}/manifest.json"


def patch_path(label: str, name: str) -> str:
    """The path of the dataset's own copy of a patch picture, relative to the dataset's root.

    Args:
        label: name of the patch set.
        name: name of the patch in the set.
    """
    return f"{GEAR}/patches/{label}/{name}"
