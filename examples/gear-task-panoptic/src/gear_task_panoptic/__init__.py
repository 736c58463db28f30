"""panoptic: panoptic segmentation in the format of COCO panoptic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Task
from gear.plugins.tasks.common import CameraOptions


@dataclass(frozen=True, slots=True, kw_only=True)
class PanopticConfig(CameraOptions):
    """Options of panoptic: those of its camera."""

    width_px: int = 1024
    height_px: int = 512


def build(config: PanopticConfig) -> Task[Any, Any]:
    """Imports what is heavy only when somebody asks for the task."""
    from gear_task_panoptic.panoptic import PanopticTask

    return PanopticTask(config)


spec: TaskSpec[PanopticConfig] = TaskSpec(
    name="panoptic",
    summary="Panoptic segmentation: Cityscapes classes in the format of COCO panoptic.",
    config=PanopticConfig,
    build=build,
    views=("left",),
    layout="images/<split>/<index>.png, annotations/panoptic_<split>/<index>.png, annotations/panoptic_<split>.json",
)


@hookimpl
def gear_tasks() -> list[TaskSpec[PanopticConfig]]:
    """Found by gear through the entry point in pyproject.toml."""
    return [spec]
