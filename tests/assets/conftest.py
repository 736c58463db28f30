"""Tests of assets draw without a display."""

from __future__ import annotations

import os

os.environ.setdefault("MUJOCO_GL", "egl")  # read when mujoco is first imported, by whichever test module comes first
