"""Reads finished evaluations: the metrics of single samples, the changes of objects, stored predictions and defended
pictures.

The folder of an evaluation may come from another person: its contents are checked, and no path in it leads outside.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import cv2
import numpy as np

from gear.contracts.evaluation import KeepsPredictions
from gear.contracts.tasks import Sample
from gear.dataset.disk_errors import explained
from gear.dataset.files import inside, read_bytes, sha256
from gear.dataset.json_text import load_json
from gear.dataset.reading import Dataset
from gear.formats.picture_size import check_size
from gear.formats.whole_picture import check_whole
from gear.metrics.object_changes import ObjectChange
from gear.plugins.text import one_line
from gear.values.errors import DatasetError, FieldError
from gear.values.frames import UInt8Image
from gear.values.serial import Json, from_json

RESULTS, PREDICTIONS, DEFENDED = "results.json", "predictions", "defended"
"""Names in the folder of an evaluation: the results, and in each dataset's folder the predictions and the pictures that
the defense returned.
"""

FORMAT, VERSION = "gear-evaluation", 1

TASK = "task"
"""Name of the report with the metrics of the task itself."""

KEPT: Any = {
    "facts": Any, "sha256": dict[str, str], "model_s": float, "defense_s": float, "score": float | None,
    "mask": dict[str, float | None] | None,
}  # fmt: skip
"""Keys and types of a sample's stored result, a JSON file, that a later run reads."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class StoredResults:
    """The part of an evaluation that belongs to one dataset.

    Attributes:
        name: name of the dataset's folder in the evaluation.
        label: title of the evaluation: model and defense.
        root: folder of the evaluation.
        metrics: metrics of the task by name, for each sample in the order of the samples; None if undefined.
        changes: by the name of a twin's folder, the changes of objects against that twin, by index of the
            sample.
        metadata: JSON of the dataset (patch, keys), as `results.json` has it.
    """

    name: str
    label: str
    root: Path
    metrics: tuple[Mapping[str, float | None], ...]
    changes: Mapping[str, Mapping[int, list[ObjectChange]]]
    metadata: Json

    def is_of(self, dataset: Dataset[Any]) -> bool:
        """Returns whether this part was computed on a dataset, by its keys and its patch; the dataset may have
        moved since.

        Args:
            dataset: one split.
        """
        plan = dataset.plan
        wanted = (plan.content_key, plan.twin_key, plan.info.patch_label)
        return wanted == tuple(self.metadata.get(key) for key in ("content_key", "twin_key", "patch"))

    def prediction(self, dataset: Dataset[Any], sample: Sample) -> Any:
        """Reads the stored prediction of a sample, in the format of the task.

        Args:
            dataset: the split on which this part was computed.
            sample: one of its samples.

        Raises:
            DatasetError: the prediction is missing or damaged, or the task stores no predictions.
        """
        task = dataset.task
        if not isinstance(task, KeepsPredictions):
            raise DatasetError(self.root, "the task stores no predictions")
        index = sample.record.index
        path = inside(self.root, f"{self.name}/samples/{index:06d}.json")
        stored = read_result(path)
        folder = inside(self.root, f"{self.name}/{PREDICTIONS}")
        check_files(folder, stored["sha256"])
        with explained(path):
            return task.decode_prediction(folder, sample, stored["facts"], dataset.plan.info)

    def prediction_files(self, index: int) -> list[Path]:
        """Returns the paths of the files of a stored prediction; empty for a task that stores predictions as JSON.

        Args:
            index: index of the sample in its dataset.

        Raises:
            DatasetError: the stored result is missing or damaged, or a file is missing, damaged or outside the
                evaluation.
        """
        stored = read_result(inside(self.root, f"{self.name}/samples/{index:06d}.json"))
        folder = inside(self.root, f"{self.name}/{PREDICTIONS}")
        check_files(folder, stored["sha256"])
        return [inside(folder, name) for name in stored["sha256"]]

    def defended(self, index: int) -> dict[str, UInt8Image]:
        """Reads the stored pictures that the defense returned for a sample, (H, W, 3) uint8 by camera.

        They may be smaller than the originals. The result is empty if none are stored.

        Args:
            index: index of the sample in its dataset.

        Raises:
            DatasetError: a picture is missing or damaged.
        """
        stored = load_json(inside(self.root, f"{self.name}/samples/{index:06d}.json"))
        return read_defended(inside(self.root, self.name), stored if isinstance(stored, dict) else {})


def open_evaluation(root: str | Path) -> tuple[StoredResults, ...]:
    """Opens a finished evaluation.

    Args:
        root: folder of the evaluation, which contains `results.json`.

    Returns:
        One entry for each evaluated dataset, in the order of the evaluation.

    Raises:
        DatasetError: the folder holds no finished evaluation of this version of gear.
    """
    root = Path(root)
    path = inside(root, RESULTS)
    if not path.exists():
        raise DatasetError(root, f"holds no finished evaluation (no {RESULTS}); run its `gear evaluate` to the end")
    found = load_json(path)
    try:
        if not isinstance(found, dict) or (found.get("format"), found.get("version")) != (FORMAT, VERSION):
            raise FieldError("format", f"must be {FORMAT}, version {VERSION}")
        return _parts(root, found)
    except (KeyError, TypeError, AttributeError, FieldError) as error:
        raise DatasetError(path, f"is no evaluation of this version of gear ({error}); evaluate again") from error


def is_evaluation(path: str | Path) -> bool:
    """Returns whether a folder holds the results of an evaluation rather than a dataset.

    Args:
        path: the folder.
    """
    return (Path(path) / RESULTS).is_file() and not (Path(path) / "gear").is_dir()


def _parts(root: Path, found: dict[str, Any]) -> tuple[StoredResults, ...]:
    defense = found.get("defense")
    label = from_json(str, found["model"]["name"], "model.name")
    label += f" + {from_json(str, defense['name'], 'defense.name')}" if defense else ""
    changes: dict[str, dict[str, dict[int, list[ObjectChange]]]] = {}
    for one in found["differences"]:
        against = changes.setdefault(from_json(str, one["row"], "row"), {}).setdefault(str(one["against"]), {})
        for change in one.get("objects", {}).get("changes", []):
            entry = from_json(ObjectChange, {key: change[key] for key in change if key != "sample"}, "changes")
            against.setdefault(from_json(int, change["sample"], "sample"), []).append(entry)
    if not found["rows"]:
        raise FieldError("rows", "names no dataset")
    parts = []
    for row in found["rows"]:
        name = from_json(str, row["name"], "name")
        metrics = tuple(
            from_json(dict[str, float | None], sample["metrics"].get(TASK, {}), "metrics")
            for sample in row["per_sample"]
        )
        parts.append(
            StoredResults(
                name=name,
                label=label,
                root=root,
                metrics=metrics,
                changes=changes.get(name, {}),
                metadata=from_json(dict[str, Any], row["dataset"], "dataset"),
            )
        )
    return tuple(parts)


def read_result(path: Path) -> dict[str, Any]:
    """Reads the stored result of a sample, a JSON file, and checks its keys and types.

    Args:
        path: the JSON file.

    Returns:
        The values by the names in `KEPT`, and `defended`: SHA-256 of each defended picture by its path, {} for none.

    Raises:
        DatasetError: the file is not a result that gear wrote.
    """
    there = load_json(path)
    if not isinstance(there, dict) or not there.keys() >= KEPT.keys():
        raise DatasetError(path, "is not the stored result of a sample")
    try:
        stored: dict[str, Any] = {name: from_json(kind, there[name], name) for name, kind in KEPT.items()}
        return stored | {DEFENDED: from_json(dict[str, str], there.get(DEFENDED, {}), DEFENDED)}
    except FieldError as error:
        raise DatasetError(path, f"is not the stored result of a sample ({error})") from error


def check_files(folder: Path, hashes: Mapping[str, str]) -> None:
    """Checks the files of a prediction.

    Args:
        folder: folder of the files.
        hashes: SHA-256 of each file by its path relative to the folder.

    Raises:
        DatasetError: a file is missing or has other bytes.
    """
    for name, digest in hashes.items():
        if sha256(read_bytes(inside(folder, name))) != digest:
            raise DatasetError(inside(folder, name), "is not what was written")


def read_defended(folder: Path, stored: Mapping[str, Any]) -> dict[str, UInt8Image]:
    """Reads the defended pictures of a sample.

    Args:
        folder: folder of the dataset in the evaluation.
        stored: the stored result of the sample; its key `defended` has the hashes of the files by path.

    Returns:
        (H, W, 3) uint8 RGB by camera.

    Raises:
        DatasetError: a picture is missing or damaged.
    """
    try:
        hashes = from_json(dict[str, str], stored.get(DEFENDED, {}), DEFENDED)
    except FieldError as error:
        raise DatasetError(folder, f"holds a damaged result of a sample ({error})") from error
    check_files(folder, hashes)
    pictures = {}
    for name in hashes:
        path = inside(folder, name)
        data = read_bytes(path)
        try:
            check_size(data)
            check_whole(data)
            decoded = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
        except (ValueError, cv2.error) as error:
            raise DatasetError(path, f"cannot be read as a picture ({one_line(error)})") from error
        if decoded is None:
            raise DatasetError(path, "is no picture")
        pictures[unquote(Path(name).stem.partition("_")[2])] = np.ascontiguousarray(decoded[..., ::-1]).astype(np.uint8)
    return pictures
