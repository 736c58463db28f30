"""What a collection needs, from its first samples: announced when it is large, refused when the disk is too small."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from gear.dataset.disk_and_time_forecast import Forecast
from gear.values.errors import GearError


def run(
    monkeypatch: pytest.MonkeyPatch, *, samples: int, sample_bytes: int, free: int, sample_s: float = 1.0
) -> list[str]:
    """The lines that a collection of equal samples is announced with."""
    now_s, said = [0.0], list[str]()
    monkeypatch.setattr(shutil, "disk_usage", lambda root: SimpleNamespace(free=free))
    watched = Forecast(Path("data"), samples, said.append, clock_s=lambda: now_s[0])
    for index in range(min(samples, 10)):
        now_s[0] += sample_s if index else 500.0  # the first one waits for the world
        watched.item_done(lambda: sample_bytes)
    return said


def test_a_collection_that_the_disk_cannot_hold_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = r"data: the missing ones of 1000000 samples need about 12 TB, and 20 GB are free there; collect fewer"
    with pytest.raises(GearError, match=problem):
        run(monkeypatch, samples=1_000_000, sample_bytes=12_000_000, free=20_000_000_000)
    assert run(monkeypatch, samples=100, sample_bytes=10_000, free=970_000) == []
    with pytest.raises(GearError):
        run(monkeypatch, samples=100, sample_bytes=10_000, free=969_999)


def test_a_large_one_is_announced_once(monkeypatch: pytest.MonkeyPatch) -> None:
    said = run(monkeypatch, samples=7203, sample_bytes=1_000_000, free=10**12, sample_s=2.0)
    assert said == ["7203 samples need about 7.2 GB of the 1 TB that are free, and 4.0 hours"]
    assert run(monkeypatch, samples=1000, sample_bytes=1000, free=10**12) == []
    assert run(monkeypatch, samples=1, sample_bytes=1000, free=10**12) == []
