"""boundary_iou: a metric for gear."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gear.contracts.hookspecs import hookimpl
from gear.contracts.specs import MetricSpec
from gear.contracts.tasks import Evaluator
from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundaryIouConfig:
    """Options of boundary_iou.

    Attributes:
        width_share: width of the band along a contour, as a share of the picture's diagonal; 0.02 in the paper's
            section 5.
    """

    width_share: float = 0.02

    def __post_init__(self) -> None:
        if not 0 < self.width_share <= 1:
            raise FieldError("width_share", f"must be above 0 and at most 1, got {self.width_share:g}")


def build(config: BoundaryIouConfig) -> Evaluator[Any, Any]:
    """A fresh evaluator; OpenCV is imported here."""
    from gear_metric_boundary_iou.boundary_iou import BoundaryIouEvaluator

    return BoundaryIouEvaluator(config.width_share)


spec: MetricSpec[BoundaryIouConfig] = MetricSpec(
    name="boundary_iou",
    summary="Boundary IoU of semantic segmentation, mean over classes (Cheng et al. 2021).",
    config=BoundaryIouConfig,
    build=build,
    tasks=("semseg",),
    metric="boundary_miou",
)


@hookimpl
def gear_metrics() -> list[MetricSpec[BoundaryIouConfig]]:
    """Called by gear, which finds this module through the entry point in pyproject.toml."""
    return [spec]
