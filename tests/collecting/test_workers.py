"""`--workers auto` fits cores and memory."""

from __future__ import annotations

import pytest

from gear.collecting import workers
from gear.collecting.workers import WORKER_BYTES, fitting_workers
from gear.values.errors import GearError
from gear.verbs.collect.request import CollectRequest


@pytest.mark.parametrize(
    ("cores", "free", "wanted"),
    [
        (8, 100 * WORKER_BYTES, 8),
        (8, 3 * WORKER_BYTES + 5, 3),
        (8, WORKER_BYTES - 1, 1),
        (2, None, 2),
    ],
)
def test_auto_fits_cores_and_memory(monkeypatch: pytest.MonkeyPatch, cores: int, free: int | None, wanted: int) -> None:
    monkeypatch.setattr(workers, "cores", lambda: cores)
    monkeypatch.setattr(workers, "free_memory_bytes", lambda: free)
    assert fitting_workers("auto") == wanted
    assert fitting_workers(5) == 5


def test_auto_is_for_this_machine() -> None:
    assert CollectRequest(workers="auto").workers == "auto"
    with pytest.raises(GearError, match="give --engine ray a number"):
        CollectRequest(workers="auto", engine="ray")
