"""Attacks on drives are checked before the first drive."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from gear.values.errors import GearError
from gear.verbs.attack.drives.job import HELD_OUT_SEED, resolve_drives
from gear.verbs.attack.drives.request import DriveAttackRequest


def request(config: Path, **changes: Any) -> DriveAttackRequest:
    return DriveAttackRequest(drive=config, out=config.parent / "out", **changes)


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"attack": "scene_specific"}, "has no network; use square or nes"),
        ({"attack": "control"}, "optimises nothing"),
        ({"driver": "truth"}, "has no cameras"),
        ({"driver": "magenta_blnd"}, "did you mean magenta_blind"),
        ({"drive_settings": ("drivers.truth={controller: blind, task: depth}",)}, "driver with --driver"),
        ({"drive_settings": ("scenarios={near_led: [30]}",)}, "did you mean near_lead"),
    ],
)
def test_what_does_not_fit_is_one_line(magenta_blind: Path, changes: dict[str, Any], problem: str) -> None:
    with pytest.raises(GearError, match=problem) as caught:
        resolve_drives(request(magenta_blind, **changes))
    assert "\n" not in str(caught.value)


def test_an_attack_is_for_one_scene_with_a_board(magenta_blind: Path) -> None:
    town = magenta_blind.read_text().split("towns: {")[1].split(": [")[0]
    with pytest.raises(GearError, match="for one scene, and the config names 2"):
        resolve_drives(request(magenta_blind, drive_settings=(f"towns={{{town}: [board, truck]}}",)))
    with pytest.raises(GearError, match="no surface for a patch"):
        resolve_drives(request(magenta_blind, drive_settings=(f"towns={{{town}: [no_billboard]}}",)))


def test_the_held_out_drives_have_other_seeds(magenta_blind: Path) -> None:
    job = resolve_drives(request(magenta_blind, held_out=2))
    assert [run.seed for run in job.drives.runs] == [0] and job.surfaces == 1
    out = magenta_blind.parent / "out"
    out.mkdir()
    (out / "patch_0.png").write_bytes(b"not read")
    assert resolve_drives(request(magenta_blind, held_out=0)).held_out() is None
    with pytest.raises(GearError, match=r"patch_0\.png"):
        job.held_out()
    (out / "patch_0.png").write_bytes(_picture())
    drives = job.held_out()
    assert drives is not None
    assert {run.seed for run in drives.runs} == {HELD_OUT_SEED, HELD_OUT_SEED + 1}
    assert {run.twin for run in drives.runs} == {"none", "random", "patch"} and len(drives.runs) == 6


def _picture() -> bytes:
    import numpy as np

    from gear.formats.png import encode_rgb

    return bytes(encode_rgb(np.zeros((4, 4, 3), np.uint8)))
