"""The metric of an attack's samples."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from gear.verbs.attack.outputs import write_samples


def test_small_pictures_are_shown_pixel_by_pixel_and_large_ones_shrunk(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    before, after = (rng.integers(0, 256, (30, 60, 3), np.uint8) for _ in range(2))
    write_samples(tmp_path, [(before, after)])
    shown = cv2.cvtColor(cv2.imread(str(tmp_path / "figures/samples.png")), cv2.COLOR_BGR2RGB)
    assert np.array_equal(shown, np.concatenate([before, after], axis=1))

    grey, white = (np.full((1024, 2048, 3), value, np.uint8) for value in (90, 255))
    write_samples(tmp_path, [(grey, white), (white, grey)])
    shown = cv2.imread(str(tmp_path / "figures/samples.png"))
    assert shown.shape == (2 * 512, 2 * 1024, 3)
    assert (shown[:512, :1024] == 90).all() and (shown[512:, :1024] == 255).all()
