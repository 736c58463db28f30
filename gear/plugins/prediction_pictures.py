"""Draws predictions as pictures for people, for tasks that draw them themselves and for tasks with objects."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gear.contracts.evaluation import DrawsPredictions, WithObjects
from gear.contracts.legends import ColourNames, Legend, Rgb, WithLegends
from gear.contracts.tasks import Sample, Task
from gear.dataset.checks.output_checks import check_previews
from gear.plugins.tasks.common import IGNORED_COLOUR, category_colour, draw_box, draw_surfaces
from gear.values.frames import UInt8Image
from gear.values.picture_objects import PictureObjects

OBJECTS = "objects"
"""Name of the picture of a task's objects and detections, which gear draws."""

SURE = 0.5
"""Score from which a detection is drawn; detections of this score count in the report `objects`."""

OBJECT_COLOUR: Rgb = (255, 255, 255)
"""Colour of the dashed boxes of ground-truth objects, RGB."""


def prediction_pictures(task: Task[Any, Any], sample: Sample, prediction: Any) -> dict[str, UInt8Image]:
    """Draws a prediction of a sample, by the task's own method or as boxes of objects and detections.

    Args:
        task: the task of the sample.
        sample: the sample with its pictures and ground truth.
        prediction: a network's prediction in the task's format.

    Returns:
        (H, W, 3) uint8 RGB pictures by name; empty for a task that draws no predictions and has no objects.

    Raises:
        TypeError: the task returned something that is no picture.
        Exception: whatever the task's method raises; the task may belong to another package.
    """
    if isinstance(task, DrawsPredictions):
        return check_previews(task.prediction_preview(sample, prediction))
    if isinstance(task, WithObjects):
        return {OBJECTS: _drawn(sample, task.picture_objects(sample, prediction), label_colours(task))}
    return {}


def picture_legends(task: Task[Any, Any]) -> dict[str, Legend]:
    """Returns the legends (colours and what they mean) of a task's previews and predictions, by name of the
    picture.

    Args:
        task: any task.
    """
    legends: dict[str, Legend] = dict(task.legends()) if isinstance(task, WithLegends) else {}
    if isinstance(task, WithObjects) and not isinstance(task, DrawsPredictions):
        classes = tuple((name, rgb) for name, rgb in label_colours(task).items() if rgb != IGNORED_COLOUR)
        legends[OBJECTS] = ColourNames(entries=(*classes, ("dashed: object of the ground truth", OBJECT_COLOUR)))
    return legends


def label_colours(task: Task[Any, Any]) -> dict[str, Rgb]:
    """Returns the colours of classes by name, as the legends of the task's previews state them; empty if it has none.

    Args:
        task: any task.
    """
    legends = task.legends().values() if isinstance(task, WithLegends) else ()
    return {name: rgb for legend in legends if isinstance(legend, ColourNames) for name, rgb in legend.entries}


def label_colour(label: str, known: Mapping[str, Rgb]) -> Rgb:
    """Returns the colour of a class in pictures of detections, RGB bytes; for a class without a known colour it
    depends only on the name.

    Args:
        label: name of the class.
        known: colours of classes by name, from `label_colours`.
    """
    return known.get(label) or category_colour(sum((i + 1) * ord(letter) for i, letter in enumerate(label)) % 180)


def _drawn(sample: Sample, found: PictureObjects, colours: Mapping[str, Rgb]) -> UInt8Image:
    picture = sample.images[found.camera].copy()
    for thing in found.objects:
        draw_box(picture, _indices(thing.box_px), OBJECT_COLOUR, dashed=True)
    for one in sorted(found.detections, key=lambda one: one.score):
        if one.score >= SURE:
            draw_box(picture, _indices(one.box_px), label_colour(one.label, colours), f"{one.label} {one.score:.2f}")
    draw_surfaces(picture, sample, found.camera)
    return picture


def _indices(box_px: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """Converts a box from edge pixels to the indices of its outermost pixels."""
    left, top, right, bottom = box_px
    return left, top, right - 1, bottom - 1


def legends_json(legends: Mapping[str, Legend]) -> dict[str, Any]:
    """Returns legends as JSON, by name of the picture: `names`, a list of [name, RGB], or `quantity`, `colours`
    and `ticks` of a colour bar.

    Args:
        legends: legends by name of the picture, from `picture_legends`.
    """
    return {
        name: {"names": [[entry, list(rgb)] for entry, rgb in one.entries]}
        if isinstance(one, ColourNames)
        else {
            "quantity": one.quantity,
            "colours": [list(rgb) for rgb in one.colours],
            "ticks": [list(tick) for tick in one.ticks],
        }
        for name, one in legends.items()
    }
