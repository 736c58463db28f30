"""Drawing on a canvas."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gear.verbs.towns.canvas import Canvas, round_step_m


@given(span=st.floats(0.5, 1e5), most=st.integers(1, 20))
def test_steps_are_round_and_few(span: float, most: int) -> None:
    step = round_step_m(span, most)
    assert span / step <= most * (1 + 1e-9)
    assert f"{step:.0e}"[0] in "125"
    assert span / step > most / 2.6 or most == 1


def test_dashes_cover_their_share() -> None:
    canvas = Canvas((400, 20), (255, 255, 255))
    canvas.dashes([[0, 10], [400, 10]], (0, 0, 0), 2.0, dash_px=12.0, gap_px=8.0)
    row = canvas.picture()[10, :, 0]
    assert (row < 128).mean() == pytest.approx(0.6, abs=0.1)
    assert 18 <= np.count_nonzero(np.diff((row < 128).astype(int)) == 1) <= 21
