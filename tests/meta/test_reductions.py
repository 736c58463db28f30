"""Nothing that is written depends on where an array lies in memory."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]

BY_ALIGNMENT = re.compile(
    r"cv2\.(sumElems|mean|meanStdDev|norm|reduce|PSNR|dotProduct)\b|\btorch\.(dot|vdot|inner|mv|addmv)\b"
)
"""Reductions that add floating-point numbers in an order which depends on the address of the array: measured for
`cv2.sumElems`, `torch.dot` and `torch.mv` of float32, and not excluded for the others of OpenCV's. Sums, means, norms,
quantiles, logarithms, matrix products, `einsum`, blurs and resizing of NumPy, OpenCV and SciPy, and sums, convolutions
and float32 matrix products of torch, gave the same bits for copies at every address in a cache line. Matrix products of
float64 in torch did not; gear has none."""


def test_no_reduction_depends_on_alignment() -> None:
    found = {
        f"{path.relative_to(ROOT)}:{number}"
        for path in sorted((ROOT / "gear").rglob("*.py"))
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if BY_ALIGNMENT.search(line)
    }
    assert not found
