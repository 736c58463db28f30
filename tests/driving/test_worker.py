"""What a worker of a study keeps open, writes and reads back."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from gear.driving import worker
from gear.values.errors import GearError


def test_a_place_that_fails_to_open_is_opened_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    shop: Any = worker._Workshop(drives=cast("Any", SimpleNamespace(casts={"a": SimpleNamespace(task="")})))
    opened: list[str] = []

    def open_place(self: Any, run: Any, cast: Any) -> Any:
        if run.town == "broken":
            raise GearError("the town is broken")
        opened.append(run.town)
        return f"place {len(opened)}"

    monkeypatch.setattr(worker._Workshop, "_opened", open_place)
    good, broken = (SimpleNamespace(driver="a", town=town, scene="s") for town in ("good", "broken"))
    assert shop.place_of(good) == shop.place_of(good) == "place 1"
    with pytest.raises(GearError, match="is broken"):
        shop.place_of(broken)
    assert shop.place_of(good) == "place 2", "the first place was closed"


def test_the_folder_of_a_drive_has_no_files_of_a_killed_run(tmp_path: Path) -> None:
    hidden = tmp_path / "drives/a/.b.gear-drive"
    hidden.mkdir(parents=True)
    (hidden / "old").write_text("of a killed run")
    worker._write(tmp_path, "drives/a/b", {"log.jsonl": b"{}"})
    assert [path.name for path in (tmp_path / "drives/a/b").iterdir()] == ["log.jsonl"]
