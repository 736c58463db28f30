"""Drives of a record are made again: an honest record repeats bit for bit, and forged ones are seen."""

from __future__ import annotations

import dataclasses
import hashlib
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

import gear
from gear.contracts.executors import Outcome, Report
from gear.dataset.executors.calibrations import CalibrationReports
from gear.dataset.locks import dataset_lock
from gear.leaderboard.reading import encoded, read_record
from gear.leaderboard.record import Record
from gear.leaderboard.verdict import Verdict
from gear.values.errors import GearError
from gear.values.progress import Callbacks
from gear.verbs.leaderboard import drive_check
from tests.shared import shared_folder
from tests.verbs.bench.conftest import write
from tests.verbs.leaderboard.conftest import ADAPTIVE, HERE

pytestmark = pytest.mark.slow  # a tiny benchmark is made, and some of its drives again

NAME = "semseg-small+blur-seed0.json"
LIBRARY = "scenarios: {near: {ttc_s: 1.0, duration_s: 1.0, lead: {speed_share: 0}}}"


@pytest.fixture
def driven(records: Path, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the tiny benchmark's records, with drives."""
    folder, before = (shared_folder(tmp_path_factory, f"benches/{name}") for name in ("driven", "recorded"))
    library = folder / "library.yml"
    with dataset_lock(folder):
        if not (folder / "whole").exists():
            library.write_text(LIBRARY)
            shutil.copytree(before / "out", folder / "out")
            drives = f"drives: {{library: {library}, scenarios: {{near: [20]}}}}\ncollect:\n  renderer"
            gear.bench(write(folder, (*ADAPTIVE, ("collect:\n  renderer", drives))), out=folder / "out", record=True)
            (folder / "whole").touch()
    return Path(shutil.copytree(folder / "out/records", tmp_path / "driven"))


def forge(path: Path, change: Callable[[Record], Record]) -> Path:
    forged = path.with_name("forged.json")
    forged.write_bytes(encoded(change(read_record(path).record)))
    return forged


def test_calibrations_are_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def drive_all(drives: Any, indices: Iterator[int], report: Report) -> None:
        for index in indices:
            CalibrationReports(report=report, index=index).callbacks().on_fit_phase("training step", 2, 2)
            report(Outcome(index=index, kind="failed", error="no place"))

    monkeypatch.setattr(drive_check, "drive_all", drive_all)
    monkeypatch.setattr(drive_check, "patches_of", lambda *given: ["patch"])
    monkeypatch.setattr(drive_check, "read_result", lambda *given: None)
    drives = SimpleNamespace(root=tmp_path, folder=lambda *given: "", identity=lambda *given: None)
    one = drive_check.Repeated(planned=cast("Any", None), drives=cast("Any", drives), number=3, run=cast("Any", None))
    seen: list[Any] = []
    callbacks = Callbacks.of(on_fit_phase=lambda *phase: seen.append(phase))
    assert drive_check._driven(one, callbacks) == "no place"
    assert seen == [("training step", 2, 2)]


def test_drives_repeat_and_forged_ones_are_seen(
    driven: Path, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    library = shared_folder(tmp_path_factory, "benches/driven") / "library.yml"

    def check(path: Path, drives: int = 4, most_pictures: int = 2000) -> Verdict:
        settings = (*HERE, f"drives.library={library}")
        return gear.check_record(
            path, samples=1, fresh=0, drives=drives, settings=settings, work=tmp_path / "work",
            most_pictures=most_pictures,
        )  # fmt: skip

    def differing(change: Callable[[Record], Record]) -> list[str]:
        found = check(forge(driven / NAME, change))
        assert found.state == "differs"
        return [one.text for one in found.findings if one.level == "differs"]

    honest = read_record(driven / NAME).record
    kinds = [one.patch for one in honest.drives]
    assert kinds == ["none", "random", "patch", "adaptive patch"]
    assert honest.controller is not None and honest.controller.name == "semseg_baseline"
    with pytest.raises(GearError, match=r"4 drives would render up to 40 pictures"):
        check(driven / NAME, most_pictures=39)
    assert not list((tmp_path / "work").rglob("leftImg8bit")), "it is refused before any picture is rendered"
    texts = {one.level: one.text for one in check(driven / NAME).findings if one.text.startswith("drives:")}
    assert texts == {"same": "drives: 4 of 4 driven again, 4 of them with an equal log"}

    def flipped(one: Record) -> Record:
        return dataclasses.replace(
            one, drives=tuple(dataclasses.replace(each, is_crash=not each.is_crash) for each in one.drives)
        )

    found = differing(flipped)
    assert sum("the outcome in the record is not that of its log" in text for text in found) == 4
    assert any("only 0 of 4 end as the record says" in text for text in found)

    def other_log(one: Record) -> Record:
        log = hashlib.sha256(b"x").hexdigest()
        return dataclasses.replace(one, drives=(dataclasses.replace(one.drives[0], log_sha256=log), *one.drives[1:]))

    assert sum("another log than in the record" in text for text in differing(other_log)) == 1
    assert any(
        "leaves it out" in text for text in differing(lambda one: dataclasses.replace(one, drives=one.drives[1:]))
    )
    none = differing(lambda one: dataclasses.replace(one, drives=(), controller=None))
    assert none == ["drives: the record's config has drives, but the record states none"]

    def invented(one: Record) -> Record:
        return dataclasses.replace(one, drives=(*one.drives, dataclasses.replace(one.drives[0], seed=77)))

    assert differing(invented) == ["drives: 1 of the record's drives are not part of its config"]

    def other_controller(one: Record) -> Record:
        assert one.controller is not None
        return dataclasses.replace(one, controller=dataclasses.replace(one.controller, name="truth"))

    assert any(text.startswith("controller: truth in the record") for text in differing(other_controller))
