"""A benchmark whose pictures do not fit on the disk ends at its first collection, not at its last."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from gear.values.errors import GearError
from gear.verbs.bench.disk import PictureSpace
from gear.verbs.bench.plan import Step


def collection(root: Path, name: str, samples: int = 10, *, task: str = "semseg", probes: bool = False) -> Step:
    arguments = {"task": task, "split": "test", "samples": samples, "out": str(root / name)}
    return Step(verb="collect", title=name, arguments=arguments | ({"probes": True} if probes else {}))


def filled(step: Step, sample_bytes: int) -> Step:
    folder = Path(step.arguments["out"])
    folder.mkdir(parents=True)
    (folder / "pictures").write_bytes(bytes(sample_bytes * step.arguments["samples"]))
    return step


def free(monkeypatch: pytest.MonkeyPatch, size: float) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=size))


def test_pictures_that_do_not_fit_are_refused_after_the_first_collection(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = [collection(tmp_path, str(number)) for number in range(5)]
    steps.append(collection(tmp_path, "probes", probes=True))
    free(monkeypatch, 50_000)
    space = PictureSpace(steps, tmp_path, lambda line: None)
    space.step_done(Step(verb="attack", title="an attack", arguments={}))
    space.step_done(filled(steps[0], 1000))
    space.step_done(steps[1])  # of a kind that is known
    space = PictureSpace(steps, tmp_path, lambda line: None)
    free(monkeypatch, 49_999)
    with pytest.raises(
        GearError, match="50 missing samples of this benchmark need about 50 kB, and 50 kB are free there; give --out"
    ):
        space.step_done(steps[0])


def test_samples_with_probes_are_measured_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    steps = [collection(tmp_path, "a"), *(collection(tmp_path, f"probes{number}", probes=True) for number in range(3))]
    free(monkeypatch, 99_999)
    space = PictureSpace(steps, tmp_path, lambda line: None)
    space.step_done(filled(steps[0], 1000))
    with pytest.raises(GearError, match="20 missing samples of this benchmark need about 100 kB"):
        space.step_done(filled(steps[1], 5000))


def test_finished_collections_need_no_space(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    steps = [collection(tmp_path, str(number)) for number in range(3)]
    manifest = Path(filled(steps[1], 1000).arguments["out"]) / "gear/test/manifest.json"
    manifest.parent.mkdir(parents=True)
    manifest.write_text("{}")
    free(monkeypatch, 10_000)
    PictureSpace(steps, tmp_path, lambda line: None).step_done(filled(steps[0], 1000))


def test_a_large_benchmark_is_announced_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    steps = [collection(tmp_path, "a"), collection(tmp_path, "b", probes=True), collection(tmp_path, "c", 4_000_000)]
    free(monkeypatch, 10**13)
    said: list[str] = []
    space = PictureSpace(steps, tmp_path, said.append)
    space.step_done(filled(steps[0], 1000))
    space.step_done(filled(steps[1], 1000))
    assert len(said) == 1 and said[0].endswith(
        "missing samples of this benchmark need about 4 GB of the 10 TB that are free"
    )
