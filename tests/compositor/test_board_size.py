"""A board whose scene gives it a size and another shape: composed patches are those that are rendered."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gear.compositor.homography import HomographyCompositor
from gear.compositor.transport import TransportCompositor
from gear.testing.tiny_town import TINY_SCENES

from .conftest import MakeTwins, gaps

EXACT_DB = 40.0
SIZE_M = (3.0, 3.0)


def test_patches_fit_a_board_of_another_size(twins: MakeTwins, tmp_path: Path) -> None:
    scenes = tmp_path / "tiny.yml"
    text = TINY_SCENES.read_text()
    assert text.count("facing_deg: 175.0}") == 1
    scenes.write_text(text.replace("facing_deg: 175.0}", "facing_deg: 175.0, size_m: [3.0, 3.0]}"))
    clean, twin = twins("board", settings=(f"scenes={scenes}",))
    assert len(clean) == len(twin) == 2
    for index in range(len(clean)):
        (surface,) = clean.sidecar(index).record.surfaces
        assert (surface.width_m, surface.height_m) == SIZE_M
        (truth,) = clean[index].surfaces
        assert truth.corners_px is not None
        x, y = np.array(truth.corners_px).T
        area_px = abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2
        assert truth.visible_px / truth.visible_fraction == pytest.approx(area_px, rel=0.1)
    exact = gaps(TransportCompositor(clean, rounding=True), twin)
    pasted = gaps(HomographyCompositor(clean, rounding=True), twin)
    assert len(exact) == len(pasted) > 0
    # Tests of the board's usual size hold the same bound.
    assert np.median([gap.psnr_db for gap in exact]) >= EXACT_DB
    # Pasted by the record's size: a wrong one would paste the patch beside the board.
    assert np.median([gap.psnr_db for gap in pasted]) > 15
