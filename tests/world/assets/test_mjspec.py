"""Files of MJCF, read so that what is sound in them compiles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gear.world.assets.mjspec import read_spec

SIGN = """
<mujoco>
  <asset><mesh name="sign" file="sign.obj" inertia="shell"/></asset>
  <worldbody><body><geom type="mesh" mesh="sign" contype="0" conaffinity="0"/></body></worldbody>
</mujoco>
"""


@pytest.mark.parametrize("name", ["town.xml", "town.mjcf"])
def test_a_flat_sign_can_be_a_body_of_its_own(name: str, tmp_path: Path) -> None:
    """Rounding may put its inertia just outside of what can be: one of these octagons or another is refused without."""
    (tmp_path / name).write_text(SIGN)
    for number in range(24):
        turn = np.arange(8) * np.pi / 4 + 0.13 * number
        points = np.stack([0.38 * np.cos(turn), np.zeros(8), 2.4 + 0.38 * np.sin(turn)], axis=1)
        lines = [f"v {x:.3f} {y:.3f} {z:.3f}" for x, y, z in points]
        (tmp_path / "sign.obj").write_text("\n".join([*lines, "f 1 2 3 4", "f 1 4 5 6", "f 1 6 7 8"]) + "\n")
        assert read_spec(tmp_path / name).compile().nbody == 2
