"""Hugging Face networks for segmentation, depth and detection, from a local folder."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gear.contracts.hookspecs import hookimpl
from gear.contracts.models import Model
from gear.contracts.specs import ModelSpec
from gear.values.errors import FieldError


@dataclass(frozen=True, slots=True, kw_only=True)
class FolderConfig:
    """Options of a network from a folder.

    Attributes:
        folder: where `save_pretrained` wrote it: config.json and model.safetensors. Nothing is downloaded.
        least_score: detections that are less sure are dropped; other tasks do not look at it.
    """

    folder: str = ""
    least_score: float = 0.05

    def __post_init__(self) -> None:
        if not 0 <= self.least_score <= 1:
            raise FieldError("least_score", f"must be 0 to 1, got {self.least_score:g}")


def builder(kind: str) -> Callable[[FolderConfig], Model]:
    """Imports transformers only when somebody asks for a model."""

    def build(config: FolderConfig) -> Model:
        from gear_model_transformers.networks import open_network

        return open_network(kind, config)

    return build


def spec_of(task: str, what: str) -> ModelSpec[FolderConfig]:
    """The spec for one task."""
    return ModelSpec(
        name=f"transformers_{task}",
        summary=f"A Hugging Face {what} network from a local folder.",
        config=FolderConfig,
        build=builder(task),
        tasks=(task,),
        views=("left",),
    )


semseg = spec_of("semseg", "semantic segmentation")
depth = spec_of("depth", "depth")
detect2d = spec_of("detect2d", "object detection")


@hookimpl
def gear_models() -> list[ModelSpec[FolderConfig]]:
    """Found by gear through the entry point in pyproject.toml."""
    return [semseg, depth, detect2d]
