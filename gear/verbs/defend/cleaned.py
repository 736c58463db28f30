"""The files that `gear defend` writes for one sample.

A marker file records the hashes of the written files and of the source pictures. A sample whose source pictures
changed, or whose files are damaged, is cleaned again.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gear.contracts.defenses import DefenseResult
from gear.contracts.specs import DefenseSpec
from gear.dataset.files import inside, read_bytes, sha256, write_whole
from gear.dataset.json_text import dump_json, load_json
from gear.dataset.reading import Dataset
from gear.formats.png import encode_labels
from gear.values.errors import DatasetError, FieldError
from gear.values.serial import from_json, to_json

FOLDER = "defense"
"""Subfolder for masks, scores and the plan of the run (its inputs), with one folder per split."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Marker:
    """The record of a cleaned sample; it is written after the sample's files.

    Attributes:
        score: the defense's score, 0..1; None for a defense without a score.
        source: sha256 of the dataset's pictures that were cleaned, by path in the dataset.
        files: sha256 of the written files, by path in the output folder.
    """

    score: float | None
    source: dict[str, str]
    files: dict[str, str]


def kept_marker(root: Path, dataset: Dataset[Any], index: int, spec: DefenseSpec[Any]) -> Marker | None:
    """Returns the marker of a cleaned sample; None if there is no marker, the source pictures changed, or a file
    is damaged.

    Args:
        root: output folder.
        dataset: dataset with the source pictures.
        index: index of the sample.
        spec: spec of the defense.
    """
    path = inside(root, marker_path(dataset.plan.info.split, index))
    if not path.is_file():
        return None
    try:
        marker = from_json(Marker, load_json(path), "marker")
        is_whole = _are_whole(dataset.root, marker.source) and _are_whole(root, marker.files)
    except (DatasetError, FieldError):
        return None
    return None if not is_whole or ("score" in spec.outputs and marker.score is None) else marker


def write_sample(
    root: Path, dataset: Dataset[Any], index: int, sample: Any, spec: DefenseSpec[Any], result: DefenseResult
) -> Marker:
    """Writes the cleaned pictures and masks of one sample, then its marker, and returns the marker.

    Args:
        root: output folder.
        dataset: dataset with the source pictures.
        index: index of the sample.
        sample: the sample.
        spec: spec of the defense.
        result: pictures, masks and score that the defense returned.
    """
    info = dataset.plan.info
    cleans = "images" in spec.outputs
    pictures = _picture_files(dataset, dataclasses.replace(sample, images=dict(result.views)) if cleans else sample)
    files = dict(pictures) if cleans else {}
    if "mask" in spec.outputs and result.mask is not None:
        for camera, mask in result.mask.items():
            levels = np.rint(np.clip(mask, 0, 1) * 65535).astype(np.uint16)
            files[f"{FOLDER}/{info.split}/masks/{index:06d}_{camera}.png"] = encode_labels(levels)
    for relative, data in files.items():
        write_whole(root, relative, data)
    marker = Marker(
        score=None if result.score is None else float(result.score),
        source={relative: sha256(read_bytes(inside(dataset.root, relative))) for relative in pictures},
        files={relative: sha256(data) for relative, data in files.items()},
    )
    write_whole(root, marker_path(info.split, index), dump_json(to_json(marker)))
    return marker


def marker_path(split: str, index: int) -> str:
    """Returns the path of a sample's marker (the JSON record that the sample was cleaned), relative to the output
    folder.

    Args:
        split: name of the split.
        index: index of the sample.
    """
    return f"{FOLDER}/{split}/samples/{index:06d}.json"


def _picture_files(dataset: Dataset[Any], sample: Any) -> dict[str, bytes]:
    """Returns the encoded files of a sample that depend on its pictures, by path; works for any task."""
    info = dataset.plan.info
    inverted = {name: np.subtract(255, picture, dtype=np.uint8) for name, picture in sample.images.items()}
    other = dataset.task.encode(dataclasses.replace(sample, images=inverted), info).files
    return {path: data for path, data in dataset.task.encode(sample, info).files.items() if other[path] != data}


def _are_whole(root: Path, digests: Mapping[str, str]) -> bool:
    """Whether all files have the given sha256.

    Raises:
        DatasetError: a file is missing.
    """
    return all(sha256(read_bytes(inside(root, relative))) == digest for relative, digest in digests.items())
