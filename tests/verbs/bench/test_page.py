"""The report page of a bench: its predictions, and that it prints without losing columns."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from tests.verbs.bench.conftest import FEW


def test_predictions_stand_beside_the_tables(made: Callable[..., Path]) -> None:
    page = (made(FEW) / "report.html").read_text()
    start = page.index("Predictions of small, where its patch does most harm")
    part = page[start : page.index("<h3>", start)]
    captions = re.findall(r"<figcaption>(.*?)</figcaption>", part)
    of_one = [
        "without a patch", "predicted without a patch", "ground truth", "with the patch", "predicted with the patch",
        "the patch after blur", "predicted with the patch behind blur",
    ]  # fmt: skip
    assert captions == [*of_one, *of_one, "colours of labels"]
    chosen = re.findall(r"<p>(tiny-board, picture \d), miou ([\d.]+) to ([\d.]+)</p>", part)
    assert len(chosen) == 2 and len({name for name, _, _ in chosen}) == 2
    harms = [float(clean) - float(patched) for _, clean, patched in chosen]
    assert harms == sorted(harms, reverse=True), "the picture that the patch harms most comes first"
    sizes = [len(data) for data in re.findall(r'src="data:image/jpeg;base64,([^"]+)"', part)]
    assert len(sizes) == len(captions) and max(sizes) < 60_000
