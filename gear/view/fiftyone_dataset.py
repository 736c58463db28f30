"""`gear.to_fiftyone`: opens a dataset, its twins and evaluations in FiftyOne, a tool that searches and shows datasets.

Needs the package fiftyone (extra `mujoco-gear[fiftyone]`), which brings its own database.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from gear.contracts.tasks import Sample, Sidecar
from gear.dataset.files import inside
from gear.dataset.reading import Dataset
from gear.plugins.stored_evaluations import StoredResults
from gear.plugins.text import one_line
from gear.values.errors import DatasetError, GearError
from gear.values.scene import WEATHER_PARAMETERS, SceneRecord
from gear.view.fiftyone_labels import (
    change_labels,
    field_name,
    mask_colours,
    mask_targets,
    prediction_labels,
    truth_labels,
)
from gear.view.picture_files import picture_file
from gear.view.sources import Source, open_compared, sources_of


def to_fiftyone(
    dataset: str | Path | Dataset[Any],
    name: str | None = None,
    *,
    twins: Sequence[str | Path] = (),
    evaluations: Sequence[str | Path] = (),
    split: str | None = None,
    samples: int | None = None,
    overwrite: bool = False,
) -> Any:
    """Makes a FiftyOne dataset of a dataset, its twins and evaluations; pictures are not copied.

    FiftyOne's dataset has one sample for each picture of a camera. The fields `index`, `camera`, `patch` and `split`
    say which picture it is; `dataset.group_by("index")` shows twins together. `weather`, `town`, `scene`, `sequence`,
    `frame` and `time_s` describe the scene. `objects`, `boxes_3d`, `labels`, `instances`, `depth` and `patches` are the
    ground truth, as far as the task measures it. Each evaluation adds `prediction_<name>`, `metrics_<name>`, and
    for detectors `changes_<name>`: the objects that a patch hides, misclassifies, moves or invents.

    Args:
        dataset: root of a dataset of any task, or an open dataset; or a folder of datasets that are twins; or the
            folder of an evaluation.
        name: name of the dataset in FiftyOne; `gear <folder>` by default.
        twins: roots of datasets that differ from the first one only in their patch; `DIR:SPLIT` selects a split.
        evaluations: folders of `gear evaluate` with results for any of these datasets.
        split: split of the dataset; optional if there is only one.
        samples: number of samples of each dataset, counted from the first; all by default.
        overwrite: replaces a dataset of the same name in FiftyOne; otherwise it is refused.

    Returns:
        The `fiftyone.Dataset`, for `fiftyone.launch_app`. FiftyOne deletes it when its database stops, unless the
        caller sets `persistent = True`.

    Raises:
        GearError: fiftyone is not installed or does not start, or has a dataset of this name.
        DatasetError: there is no finished split, a dataset is no twin, an evaluation is of other datasets, or a file
            is damaged.
    """
    root = dataset.root if isinstance(dataset, Dataset) else dataset
    chosen = dataset.plan.info.split if isinstance(dataset, Dataset) else split
    opened, others, found = open_compared(root, twins, chosen)
    sources = sources_of(opened, others, [*found, *evaluations], Path("view.html"))
    fiftyone = _package()
    wanted = name or f"gear {opened.root.resolve().name}"
    if fiftyone.dataset_exists(wanted) and not overwrite:
        raise GearError(f"FiftyOne has a dataset {wanted!r}; give another name, or overwrite=True")
    unfinished = fiftyone.Dataset()
    try:
        unfinished.default_mask_targets = mask_targets()
        unfinished.app_config.color_scheme = fiftyone.ColorScheme(default_mask_targets_colors=mask_colours())
        unfinished.add_samples(_samples(fiftyone, sources, samples), dynamic=True, progress=False)
        if fiftyone.dataset_exists(wanted):
            fiftyone.delete_dataset(wanted)
        unfinished.name = wanted
    except BaseException:
        unfinished.delete()
        raise
    return unfinished


def _package() -> Any:
    """Imports fiftyone and starts its database."""
    try:
        import fiftyone

        fiftyone.list_datasets()  # the first query starts the database
    except ImportError as error:
        raise GearError("fiftyone is not installed; pip install 'mujoco-gear[fiftyone]'") from error
    except Exception as error:  # of many classes: the database is missing, too old, or does not start
        raise GearError(f"fiftyone does not start: {one_line(error)}") from error
    return fiftyone


def _samples(fiftyone: Any, sources: Sequence[Source], samples: int | None) -> Iterator[Any]:
    for source in sources:
        count = len(source.dataset) if samples is None else min(samples, len(source.dataset))
        for index in range(count):
            yield from _pictures(fiftyone, source, index)


def _pictures(fiftyone: Any, source: Source, index: int) -> Iterator[Any]:
    """Makes FiftyOne's samples of one sample: one for each camera."""
    dataset = source.dataset
    sidecar, sample = dataset.sidecar(index), dataset[index]
    fields = truth_labels(fiftyone, dataset.task, sample, _files(dataset, sidecar))
    for part in source.evaluated:
        for camera, labels in _evaluated(fiftyone, dataset, part, sample).items():
            fields[camera] |= labels
    for camera, pixels in sample.images.items():
        relative = picture_file(dataset.root, sidecar, pixels)
        if relative is None:
            raise DatasetError(dataset.root, f"sample {index} has no picture file of camera {camera!r}")
        height, width = pixels.shape[:2]
        info = dataset.plan.info
        yield fiftyone.Sample(
            filepath=str(inside(dataset.root, relative).resolve()),
            metadata=fiftyone.ImageMetadata(width=width, height=height, num_channels=3),
            tags=[info.split, info.patch_label],
            camera=camera,
            split=info.split,
            patch=info.patch_label,
            **_scene(fiftyone, sample.record),
            **fields[camera],
        )


def _files(dataset: Dataset[Any], sidecar: Sidecar) -> list[Path]:
    """Paths of the files of a sample; paths that lead outside the dataset are refused."""
    auxiliary = {file.path for file in sidecar.auxiliary.values()}
    return [inside(dataset.root, path) for path in sidecar.files if path not in auxiliary]


def _evaluated(fiftyone: Any, dataset: Dataset[Any], part: StoredResults, sample: Sample) -> dict[str, dict[str, Any]]:
    """Returns prediction, metrics and changed objects of a sample, by camera and name of the field."""
    name, index = field_name(part.label), sample.record.index
    prediction, files = part.prediction(dataset, sample), part.prediction_files(index)
    camera, label = prediction_labels(fiftyone, dataset.task, sample, prediction, files)
    labels = {} if label is None else {f"prediction_{name}": label}
    if index < len(part.metrics):
        labels[f"metrics_{name}"] = _document(fiftyone, part.metrics[index])
    changes = [one for against in part.changes.values() for one in against.get(index, [])]
    if part.changes:
        height, width = sample.images[camera].shape[:2]
        labels[f"changes_{name}"] = change_labels(fiftyone, changes, (width, height))
    return {camera: labels}


def _scene(fiftyone: Any, record: SceneRecord) -> dict[str, Any]:
    """Returns the fields that describe the scene of a sample."""
    weather = {parameter: getattr(record.weather, parameter) for parameter in WEATHER_PARAMETERS}
    roles = [actor.role for actor in record.actors]
    return {
        "index": record.index,
        "town": record.town,
        "scene": record.scene,
        "seed": record.seed,
        "sequence": record.sequence,
        "frame": record.frame,
        "time_s": float(record.time_s),
        "weather": record.weather.name,
        "weather_parameters": _document(fiftyone, weather),
        "vehicles": sum(role in ("npc", "parked", "carrier") for role in roles),
        "pedestrians": roles.count("pedestrian"),
    }


def _document(fiftyone: Any, values: Mapping[str, float | None]) -> Any:
    """Makes FiftyOne's form of a mapping of numbers; values of None are left out."""
    return fiftyone.DynamicEmbeddedDocument(
        **{field_name(name): float(value) for name, value in values.items() if value is not None}
    )
