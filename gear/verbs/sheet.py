"""A contact sheet: what a person looks at first."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from gear.contracts.tasks import Sample
from gear.dataset.files import refuse_folder, write_alone
from gear.dataset.output_checks import check_previews
from gear.plugins.build import blamed, find, name_of_task
from gear.plugins.datasets import open_dataset
from gear.values.frames import UInt8Image

CELL_WIDTH_PX = 640
CAPTION_PX = 22
INK, PAPER = (235, 235, 235), (24, 24, 24)


def contact_sheet(path: str | Path, *, split: str | None = None, samples: int = 12) -> UInt8Image:
    """Pictures of the first samples, one row each: every preview that the task offers, with its name.

    Returns:
        (H, W, 3) uint8 RGB.

    Raises:
        DatasetError: there is no finished split to show.
        PluginError: a third party's task failed, or gave no pictures to look at.
    """
    dataset = open_dataset(path, split)
    found = find("task", name_of_task(dataset.plan.task))
    rows: list[UInt8Image] = []
    for sample in dataset[: min(samples, len(dataset))]:
        with blamed(found, f"preview of sample {sample.record.index}"):
            previews = check_previews(dataset.task.preview(sample))
            if not previews:
                raise ValueError("there is no picture")
        rows.append(_beside([_cell(picture, caption(sample, name)) for name, picture in previews.items()]))
    width = max(row.shape[1] for row in rows)
    return np.concatenate([_widened(row, width) for row in rows])


def caption(sample: Sample, name: str) -> str:
    """The line over a preview: sample, name, scene, and how the first two surfaces are seen.

    A preview that is called as a camera says what that camera sees, any other one what the first camera does.
    """
    record = sample.record
    camera = name if name in sample.images else record.cameras[0].name
    seen = [truth for truth in sample.surfaces if truth.camera == camera][:2]
    surfaces = ", ".join(f"{truth.name} {truth.visible_fraction:.0%} at {truth.distance_m:.0f} m" for truth in seen)
    return f"{record.split} {record.index:06d}  {name}  {record.scene}  {surfaces}"


def sheet(path: str | Path, out: str | Path = "sheet.png", *, split: str | None = None, samples: int = 12) -> Path:
    """Writes the contact sheet of a dataset as a PNG.

    Raises:
        DatasetError: there is nothing to show, or `out` cannot be written.
    """
    target = Path(out)
    refuse_folder(target)
    data = cv2.imencode(".png", contact_sheet(path, split=split, samples=samples)[..., ::-1])[1].tobytes()
    write_alone(target, data)
    return target


def _cell(picture: UInt8Image, caption: str) -> UInt8Image:
    height = round(picture.shape[0] * CELL_WIDTH_PX / picture.shape[1])
    small = cv2.resize(picture, (CELL_WIDTH_PX, height), interpolation=cv2.INTER_AREA)
    bar = np.full((CAPTION_PX, CELL_WIDTH_PX, 3), PAPER, np.uint8)
    cv2.putText(bar, caption, (6, 15), cv2.FONT_HERSHEY_SIMPLEX, 0.4, INK, 1, cv2.LINE_AA)
    return np.concatenate([bar, small])


def _beside(cells: list[UInt8Image]) -> UInt8Image:
    height = max(cell.shape[0] for cell in cells)
    filled = [
        np.concatenate([cell, np.full((height - cell.shape[0], cell.shape[1], 3), PAPER, np.uint8)]) for cell in cells
    ]
    return np.concatenate(filled, axis=1)


def _widened(row: UInt8Image, width: int) -> UInt8Image:
    return np.concatenate([row, np.full((row.shape[0], width - row.shape[1], 3), PAPER, np.uint8)], axis=1)
