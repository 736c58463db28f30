"""The figures of a patch folder."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from gear.verbs.attack.curve_titles import HELD_OUT, curve_title
from gear.verbs.attack.outputs import write_curves, write_samples


def test_the_figure_of_samples_is_written_pixel_by_pixel(tmp_path: Path) -> None:
    drawn = np.random.default_rng(0).integers(0, 256, (30, 60, 3), np.uint8)
    write_samples(tmp_path, drawn)
    assert np.array_equal(cv2.imread(str(tmp_path / "figures/samples.png"))[..., ::-1], drawn)


@pytest.mark.parametrize(
    ("name", "title"),
    [
        ("miss", "miss (up is better for the attack)"),
        ("tiny/cross_entropy", "tiny/cross_entropy (up is better for the attack)"),
        ("gradient", "gradient"),
        ("tiny/smoothness", "tiny/smoothness"),
        (HELD_OUT, f"{HELD_OUT} (up is better for the attack)"),
    ],
)
def test_titles_state_which_direction_is_better(name: str, title: str) -> None:
    assert curve_title(name) == title


def test_titles_are_in_the_figure_of_curves(tmp_path: Path) -> None:
    """A term has a line with its direction, so that its figure is not that of a norm with the same values."""
    pictures = []
    for name in ("miss", "gradient"):
        write_curves(tmp_path, "short", {name: [1.0, 2.0]}, [])
        pictures.append((tmp_path / "figures/curves.png").read_bytes())
    assert pictures[0] != pictures[1]
