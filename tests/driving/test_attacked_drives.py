"""Drives as samples of black-box attacks, with a severity that is known."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch

from gear.collecting.patch_sources import PatchSet
from gear.contracts.attacks import Budget, HarmObjective
from gear.driving import attacked_drives
from gear.driving.attacked_drives import (
    AttackedDrive,
    DriveObjective,
    PassThroughCompositor,
    PatchSurfaces,
    PlaceholderModel,
    tried_patch,
)
from gear.driving.drives import DriveRun
from gear.plugins.attacks.nes import Nes, NesConfig
from gear.plugins.attacks.optimisation.objectives import default_objective
from gear.plugins.attacks.square import Square, SquareConfig

SURFACES = ("left", "right")


def run(seed: int) -> DriveRun:
    return DriveRun(driver="d", town="t", scene="s", scenario="stopped_lead", speed_kmh=40.0, seed=seed, twin="patch")


@pytest.fixture
def samples(monkeypatch: pytest.MonkeyPatch) -> list[AttackedDrive]:
    """Three drives whose severity is the redness of the left patch plus the blueness of the right one."""

    def drive_once(worker: Any, run: DriveRun, patch: PatchSet) -> Any:
        left, right = (image.reshape(-1, 3).mean(axis=0) / 255 for image in patch.images)
        return SimpleNamespace(log=float(left[0] - left[2] + right[2] - right[0] + run.seed))

    monkeypatch.setattr(attacked_drives, "drive_once", drive_once)
    monkeypatch.setattr(attacked_drives, "severity", lambda log: log)
    worker: Any = None
    objective = DriveObjective(worker=worker)
    record = PatchSurfaces(surfaces=SURFACES)
    return [AttackedDrive(run=run(seed), record=record, objective=objective) for seed in range(3)]


def test_the_harm_is_the_mean_severity_and_equal_drives_are_made_once(samples: list[AttackedDrive]) -> None:
    objective = default_objective(samples[0])
    assert objective is samples[0].objective and isinstance(objective, HarmObjective)
    passage = PassThroughCompositor(surfaces=SURFACES)
    red, blue = (torch.zeros(3, 4, 6) for _ in SURFACES)
    red[0], blue[2] = 1.0, 1.0
    views = {name: passage.compose([red, blue], [0, 2], name) for name in samples[0].images}
    assert list(views) == list(SURFACES) and views["left"].shape == (2, 3, 4, 6)
    model: Any = PlaceholderModel()
    for _ in range(2):
        assert objective.harm(model, views, [samples[0], samples[2]], [0, 2]) == pytest.approx(2.0 + 1.0)
    assert samples[0].objective.drives_made == 2


@pytest.mark.parametrize(
    "attack",
    [
        Square(SquareConfig(height_px=4, width_px=8, area=1.0, batch=1, turns=1)),
        Nes(NesConfig(height_px=4, width_px=8, grid_px=4, pairs=4, step=0.1, batch=1)),
    ],
)
def test_black_box_attacks_find_the_patch_that_is_known_to_be_worst(attack: Any, samples: list[AttackedDrive]) -> None:
    model: Any = PlaceholderModel()
    budget = Budget(steps=600, queries=600)
    rng = np.random.default_rng(1)
    patches = attack.optimise(model, samples, PassThroughCompositor(surfaces=SURFACES), budget=budget, rng=rng)
    left, right = (patch.rgb.reshape(-1, 3).mean(axis=0) for patch in patches)
    assert left[0] - left[2] > 0.8 and right[2] - right[0] > 0.8


def test_patches_are_tried_as_they_would_be_printed() -> None:
    patch = tried_patch([np.full((2, 3, 3), 0.5, np.float32), np.full((2, 3, 3), 1.5, np.float32)])
    assert [int(image[0, 0, 0]) for image in patch.images] == [128, 255]
    assert patch.digest and patch.images[0].dtype == np.uint8


def test_a_driver_is_no_network(samples: list[AttackedDrive]) -> None:
    with pytest.raises(TypeError, match="only within its drives"):
        PlaceholderModel().predict({})
    with pytest.raises(TypeError, match="only within its drives"):
        samples[0].objective.terms()
