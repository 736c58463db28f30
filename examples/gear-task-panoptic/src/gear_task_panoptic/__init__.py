"""panoptic: panoptic segmentation in the format of COCO panoptic, and a baseline model for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model
from gear.contracts.specs import ModelSpec, TaskSpec
from gear.contracts.tasks import Task
from gear.plugins.tasks.common import CameraOptions
from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class PanopticConfig(CameraOptions):
    """Options of panoptic: those of its camera."""

    width_px: int = 1024
    height_px: int = 512


def build(config: PanopticConfig) -> Task[Any, Any]:
    """The task. Its module is imported here, so that listing plugins stays quick."""
    from gear_task_panoptic.panoptic import PanopticTask

    return PanopticTask(config)


@dataclass(frozen=True, slots=True, kw_only=True)
class PartsConfig:
    """Options of panoptic_parts.

    Attributes:
        model: name of a semantic segmentation network.
        weights: that network's option `weights`; "" keeps its default.
        least_px: parts with fewer pixels are void.
    """

    model: str = "ddrnet23_slim"
    weights: str = ""
    least_px: int = 100

    def __post_init__(self) -> None:
        if self.least_px < 1:
            raise FieldError("least_px", f"must be at least 1, got {self.least_px}")


def build_parts(config: PartsConfig) -> Model:
    """The model. Its module is imported here, so that listing plugins stays quick."""
    from gear_task_panoptic.baseline import Parts

    return Parts(config)


parts: ModelSpec[PartsConfig] = ModelSpec(
    name="panoptic_parts",
    summary="A baseline: connected parts of what a semantic segmentation network sees.",
    config=PartsConfig,
    build=build_parts,
    tasks=("panoptic",),
    views=("left",),
)

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
    """Called by gear, which finds this module through the entry point in pyproject.toml."""
    return [spec]


@hookimpl
def gear_models() -> list[ModelSpec[PartsConfig]]:
    """The baseline model of the task."""
    return [parts]
