"""Attacks of many scenes: one patch folder for each, over the workers of an engine."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gear
from gear.cli.main import main
from gear.dataset.executors.in_process import InThisProcess
from gear.testing.tiny_networks import tiny_segmenter
from gear.values.errors import GearError
from gear.verbs.attack import per_scene
from gear.verbs.attack.per_scene import Engine, folder_name
from tests.verbs.attack.conftest import SMALL
from tests.verbs.conftest import Small, put_package


@pytest.fixture
def scenes(small: Small, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """Datasets of two scenes, the first of them twice."""
    put_package(monkeypatch, [tiny_segmenter])
    return [small(), small(scene="truck"), small(seed=5)]


def test_each_scene_gets_the_patches_of_its_own_attack(tmp_path: Path, scenes: list[Path]) -> None:
    given: dict[str, Any] = {"model": "tiny_segmenter", "steps": 2, "settings": SMALL}
    seen: list[tuple[int, int]] = []
    reports = gear.attack_scenes(
        scenes, out=tmp_path / "all", on_progress=lambda done, total: seen.append((done, total)), **given
    )
    assert list(reports) == ["tiny-board", "tiny-truck"] and seen == [(0, 2), (1, 2), (2, 2)]
    alone = gear.attack([scenes[0], scenes[2]], out=tmp_path / "alone", **given)
    assert reports["tiny-board"].out == tmp_path / "all/tiny-board" and reports["tiny-board"].made
    assert len(reports["tiny-board"].facts["data"]) == 2 and len(reports["tiny-truck"].facts["data"]) == 1
    for mine, wanted in zip(reports["tiny-board"].patches, alone.patches, strict=True):
        assert np.array_equal(mine.rgb, wanted.rgb)
    again = gear.attack_scenes(scenes, out=tmp_path / "all", **given)
    assert not any(report.made for report in again.values())


def test_a_scene_that_fails_costs_no_other(tmp_path: Path, scenes: list[Path]) -> None:
    other = tmp_path / "all/tiny-board/gear/test/plan.json"
    other.parent.mkdir(parents=True)
    other.write_text("{}")
    notes: list[str] = []
    with pytest.raises(
        GearError,
        match=r"^tiny-board: .*is a dataset; make patches in a folder of their own; .*",
    ):
        gear.attack_scenes(
            scenes[:2],
            out=tmp_path / "all",
            model="tiny_segmenter",
            steps=1,
            settings=SMALL,
            on_warning=notes.append,
        )
    assert (tmp_path / "all/tiny-truck/attack.json").is_file()
    assert any(note.startswith("tiny-board: ") for note in notes)


def test_data_for_validation_belong_to_their_scene(tmp_path: Path, scenes: list[Path]) -> None:
    with pytest.raises(GearError, match="scene tiny-truck is in --data, but not in --val"):
        gear.attack_scenes(scenes[:2], val=scenes[2], out=tmp_path, model="tiny_segmenter")
    with pytest.raises(GearError, match="scene tiny-truck is in --val, but not in --data"):
        gear.attack_scenes(scenes[0], val=scenes[1], out=tmp_path, model="tiny_segmenter")


def test_the_command_and_its_flags(
    tmp_path: Path, scenes: list[Path], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[Any] = []

    def opened(name: str, **given: Any) -> InThisProcess:
        asked.append((name, given["workers"], given["address"]))
        return InThisProcess()

    monkeypatch.setattr(per_scene, "open_executor", opened)
    data = [word for root in scenes[:2] for word in ("--data", str(root))]
    command = ["attack", "--model", "tiny_segmenter", *data, "--out", str(tmp_path / "all"), "--steps", "1"]
    command += [word for setting in SMALL for word in ("--set", setting)]
    assert main([*command, "--per-scene", "--engine", "slurm", "--address", "gpu", "--engine-workers", "3"]) == 0
    assert asked == [("slurm", 3, "gpu")]
    out = capsys.readouterr().out
    assert str(tmp_path / "all/tiny-board") in out and str(tmp_path / "all/tiny-truck") in out
    assert main([*command, "--engine-workers", "3"]) == 2
    assert "--per-scene" in capsys.readouterr().err
    assert main([*command, "--per-scene", "--verify", "x"]) == 2


def test_a_single_worker_is_this_process() -> None:
    assert isinstance(Engine().opened(0), InThisProcess)
    with pytest.raises(GearError, match="engine_workers must be at least 1"):
        Engine(workers=0)


def test_names_of_strangers_lead_to_no_other_folder(tmp_path: Path) -> None:
    assert folder_name("town10", "my.yml:corner") == "town10-my.yml:corner"
    names = [
        ("/up/x", "board"),
        ("..", "../../x"),
        ("a\x1b[2J", "b\ud800"),
        ("t" * 300, "s"),
        ("t" * 301, "s"),
        (".", "x"),
    ]
    made = [folder_name(*one) for one in names]
    for name in made:
        assert (tmp_path / name).parent == tmp_path and name.isprintable() and not name.startswith(".")
        assert len(name) <= 120 and "/" not in name
    assert len(set(made)) == len(made)
    assert folder_name("a/b", "c") != folder_name("a_b", "c")
