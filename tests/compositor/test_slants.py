"""Composed against rendered where it is hard: slants to 70 degrees, boards far, near, cut off, half hidden."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gear
from gear.collecting.job import resolve
from gear.collecting.pipeline import collect_samples
from gear.collecting.session import Session, open_session
from gear.compositor.transport import TransportCompositor
from gear.config.load import load_collection
from gear.dataset.plan import manifest_facts
from gear.dataset.reading import Dataset
from gear.dataset.store import Store
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.geometry import RigidTransform
from gear.values.scene import Pose, SceneRecord

from .conftest import Twins, gaps


@dataclass(frozen=True)
class Look:
    """A camera before the first board: metres away, degrees off its normal, degrees that it looks past it."""

    distance_m: float
    slant_deg: float
    past_deg: float = 0.0
    hidden: bool = False


LOOKS = (
    Look(12, 0), Look(12, 30), Look(12, 50), Look(12, 60), Look(12, -65), Look(12, 70), Look(30, 45), Look(30, 60),
    Look(5, 10), Look(9, 20, 40), Look(6, -40, -35), Look(14, 15, 0, True),
)  # fmt: skip


def looking(record: SceneRecord, look: Look) -> SceneRecord:
    """The record with its cameras there, and a car before the board where it is to be hidden."""
    world_from_surface = record.world_from_surface(record.surfaces[0])
    slant, turned = math.radians(look.slant_deg), math.radians(look.slant_deg + look.past_deg)
    c, s = math.cos(turned), math.sin(turned)
    rotation = world_from_surface.rotation @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    away = np.array([math.sin(slant), 0.1, -math.cos(slant)]) * look.distance_m
    position = world_from_surface.apply(away)
    pose = Pose.from_transform(RigidTransform.from_parts("world", "camera", rotation, position))
    actors = list(record.actors)
    if look.hidden:
        number = next(i for i, actor in enumerate(actors) if actor.role != "ego")
        before = world_from_surface.apply(away * 0.5 + np.array([1.5, 1.2, 0.0]))
        actors[number] = replace(actors[number], world_from_actor=Pose(position_m=tuple(float(v) for v in before)))
    cameras = tuple(replace(camera, world_from_camera=pose) for camera in record.cameras)
    return replace(record, cameras=cameras, actors=tuple(actors))


class Looking(Session):
    """A session whose samples are looked at as `LOOKS` say."""

    def record(self, index: int) -> SceneRecord:
        return looking(super().record(index), LOOKS[index])


@pytest.fixture(scope="module")
def looks(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Twins]:
    """A split with probes of all looks, and its twin."""

    def split(root: Path, renderer: str, quality: str, patch: str) -> Dataset[Any]:
        flags = {
            "task": "semseg", "town": str(TINY_TOWN), "scene": "board", "split": "train", "samples": str(len(LOOKS)),
            "renderer": renderer, "quality": quality, "patch": patch, "root": str(root),
            "probes": "true" if patch == "none" else "false",
        }  # fmt: skip
        settings = [f"scenes={TINY_SCENES}", "options.width_px=320", "options.height_px=160"]
        job = resolve(load_collection(None, flags, settings))
        root.mkdir()
        store = Store(root, job.plan)
        store.open(job.patch.files)
        with open_session(job) as plain:
            parts = {name: getattr(plain, name) for name in Session.__dataclass_fields__}
            session = Looking(**parts)
            collect_samples(session, store, store.missing(), lambda _: None)
        store.close(session.task, manifest_facts(job.plan))
        return gear.open_dataset(root)

    @cache
    def make(renderer: str, quality: str) -> Twins:
        folder = tmp_path_factory.mktemp(f"{renderer}-{quality}")
        return split(folder / "clean", renderer, quality, "none"), split(folder / "twin", renderer, quality, "random")

    return make


@pytest.mark.parametrize(
    ("renderer", "quality"),
    [
        ("classic", "fast"),
        pytest.param("classic", "film", marks=pytest.mark.slow),
        ("raster", "fast"),
        pytest.param("raster", "film", marks=pytest.mark.slow),
        pytest.param("filament", "film", marks=pytest.mark.slow),
        pytest.param("filament", "fast", marks=pytest.mark.slow),
    ],
)
def test_every_look_is_composed_as_it_is_rendered(looks: Callable[..., Twins], renderer: str, quality: str) -> None:
    clean, twin = looks(renderer, quality)
    found = gaps(TransportCompositor(clean, rounding=True), twin)
    assert len(found) == len(LOOKS), "the board is seen in every look"
    slants = [sample.surfaces[0].incidence_deg for sample in twin]
    assert max(slants) > 69
    values = [gap.psnr_db for gap in found]
    assert min(values) >= 40
