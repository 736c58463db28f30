"""Contact sheets: one picture with the first samples of a dataset and their ground truth."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2

from gear.contracts.legends import ColourNames, WithLegends
from gear.contracts.tasks import Sample
from gear.dataset.checks.output_checks import check_previews
from gear.dataset.files import check_output_file, write_alone
from gear.plugins.build import blamed, find, name_of_task
from gear.plugins.datasets import open_dataset
from gear.reporting.display import displayed
from gear.reporting.legend import draw_legend
from gear.reporting.picture_grid import captioned, side_by_side, stacked
from gear.values.frames import UInt8Image
from gear.values.progress import Callbacks, Progress

CELL_WIDTH_PX = 640


def contact_sheet(
    path: str | Path, *, split: str | None = None, samples: int = 12, on_progress: Progress | None = None
) -> UInt8Image:
    """Draws the first samples of a dataset: one row per sample, with all pictures that the task draws as previews.

    Legends of the previews are added at the bottom if the task has legends.

    Args:
        path: root of a dataset.
        split: split of the dataset; optional if there is only one.
        samples: number of rows.
        on_progress: called after every sample with the numbers of finished and of all samples.

    Returns:
        (H, W, 3) uint8 RGB.

    Raises:
        DatasetError: there is no finished split to show.
        PluginError: the task of another package failed, or returned no pictures.
    """
    dataset = open_dataset(path, split)
    found = find("task", name_of_task(dataset.plan.task))
    rows: list[UInt8Image] = []
    names: list[str] = []
    count = min(samples, len(dataset))
    report = Callbacks.of(on_progress=on_progress).on_progress
    for sample in dataset[:count]:
        with blamed(found, f"preview of sample {sample.record.index}"):
            previews = check_previews(dataset.task.preview(sample))
            if not previews:
                raise ValueError("there is no picture")
        rows.append(
            side_by_side(
                [captioned(picture, caption(sample, name), CELL_WIDTH_PX) for name, picture in previews.items()]
            )
        )
        names = list(previews)
        report(len(rows), count)
    with blamed(found, "legends"):
        rows += _legends(dataset.task, names)
    return stacked(rows)


def caption(sample: Sample, name: str) -> str:
    """Returns the caption of a preview: split, index, preview, scene, and visible share and distance of the first two
    surfaces.

    The visible share is measured in the camera with the preview's name, or in the first camera if there is no such
    camera.

    Args:
        sample: the sample.
        name: name of the preview.
    """
    record = sample.record
    camera = name if name in sample.images else record.cameras[0].name
    seen = [truth for truth in sample.surfaces if truth.camera == camera][:2]
    surfaces = ", ".join(f"{truth.name} {truth.visible_fraction:.0%} at {truth.distance_m:.0f} m" for truth in seen)
    return f"{record.split} {record.index:06d}  {name}  {record.scene}  {surfaces}"


def sheet(
    path: str | Path,
    out: str | Path = "sheet.png",
    *,
    split: str | None = None,
    samples: int = 12,
    progress: bool = False,
    on_progress: Progress | None = None,
) -> Path:
    """Writes the contact sheet of a dataset, which shows its first samples with their ground truth, as a PNG.

    Args:
        path: root of a dataset.
        out: PNG file to write.
        split: split of the dataset; optional if there is only one.
        samples: number of rows, one per sample.
        progress: shows a progress bar.
        on_progress: called after every sample with the numbers of finished and of all samples.

    Returns:
        The path of the PNG.

    Raises:
        DatasetError: there is no finished split, or `out` cannot be written.
        PluginError: the task of another package failed, or returned no pictures.
    """
    target = Path(out)
    check_output_file(target)
    with displayed(Callbacks.of(on_progress=on_progress), "sheet", progress=progress) as shown:
        picture = contact_sheet(path, split=split, samples=samples, on_progress=shown.on_progress)
    write_alone(target, cv2.imencode(".png", picture[..., ::-1])[1].tobytes())
    return target


def _legends(task: object, names: Sequence[str]) -> list[UInt8Image]:
    """Returns one row of pictures with the legend of each preview; an empty list if the task has no legends."""
    if not isinstance(task, WithLegends):
        return []
    legends = task.legends()
    if not any(name in legends for name in names):
        return []
    empty = ColourNames(entries=())
    return [side_by_side([draw_legend(legends.get(name, empty), CELL_WIDTH_PX) for name in names])]
