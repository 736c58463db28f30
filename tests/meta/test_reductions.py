"""Nothing that is written depends on where an array lies in memory."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]

BY_ALIGNMENT = re.compile(r"cv2\.(sumElems|mean|meanStdDev|norm|reduce|PSNR|dotProduct)\b|\btorch\.(dot|vdot|inner)\b")
"""Reductions that add floating-point numbers in an order which depends on the address of the array: measured for
`cv2.sumElems` of float32 and `torch.dot` of float32, and not excluded for the others of OpenCV's."""


def test_no_reduction_depends_on_alignment() -> None:
    found = {
        f"{path.relative_to(ROOT)}:{number}"
        for path in sorted((ROOT / "gear").rglob("*.py"))
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if BY_ALIGNMENT.search(line)
    }
    assert not found
