"""`gear verify`: a byte of every file of every task is flipped; it is found, and repaired to the same bytes."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

import gear
from gear.cli.main import main
from gear.contracts.executors import Outcome
from gear.dataset.checks.verification import Finding
from gear.dataset.failures import note_failure
from gear.dataset.layout import CARDS
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import DatasetError
from gear.verbs.verify import run as module
from gear.verbs.verify.recipe import Sources
from gear.verbs.verify.report import VerifyReport
from tests.dataset.splits import tree
from tests.verbs.conftest import Collected, Copy, Install

TASKS = ["semseg", "detect2d", "stereo3d", "depth"]


def flip(path: Path, place: float) -> None:
    """Changes one bit of a file, at a share of its length."""
    data = bytearray(path.read_bytes())
    data[min(int(place * len(data)), len(data) - 1)] ^= 1
    path.write_bytes(data)


def repaired(root: Path, **more: Any) -> VerifyReport:
    return gear.verify(root, repair=True, town=TINY_TOWN, scenes=TINY_SCENES, **more)


@pytest.fixture(scope="module")
def patch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("patch") / "stripes.png"
    cv2.imwrite(str(path), np.random.default_rng(1).integers(0, 256, (20, 40, 3), dtype=np.uint8))
    return path


@pytest.mark.parametrize("task", TASKS)
def test_a_flipped_byte_of_any_file_is_found(task: str, tmp_path: Path, copy_small: Copy, patch: Path) -> None:
    root = copy_small(task, tmp_path / "data", patch=patch, probes=True)
    whole = gear.verify(root)
    assert whole.is_whole and whole.files == len(tree(root)) and not whole.findings
    for relative, data in tree(root).items():
        for place in (0, 0.3, 0.77, 1):
            flip(root / relative, place)
            found = gear.verify(root).findings
            assert [one.problem for one in found] == ["damaged"], (relative, place)
            assert found[0].path == relative
            (root / relative).write_bytes(data)
        for text in (b"", None):
            (root / relative).write_bytes(text) if text is not None else (root / relative).unlink()
            found = gear.verify(root).findings
            problems = ["missing" if text is None else "damaged"] * (text is not None or relative not in CARDS)
            certain = [(one.path, one.problem) for one in found if one.problem != "unchecked"]
            assert certain == [(relative, problem) for problem in problems]
            assert len(found) == len(certain) or (relative.endswith("manifest.json") and text == b"")
            (root / relative).write_bytes(data)


@pytest.mark.parametrize("task", TASKS)
def test_what_is_damaged_is_made_again_to_the_byte(task: str, tmp_path: Path, copy_small: Copy, patch: Path) -> None:
    root = copy_small(task, tmp_path / "data", patch=patch, probes=True)
    before, broken = tree(root), []
    for relative in before:
        if ("0001" in relative and "/samples/" not in relative) or (
            relative.endswith(".txt") and "0000" not in relative
        ):
            flip(root / relative, 0.5)
            broken.append(relative)
    kept = {path: (root / path).stat().st_ino for path in before if path not in broken and "0000" in path}
    report = repaired(root)
    assert report.is_whole and not report.unrepaired, report.lines()
    assert {one.path for one in report.repaired} == set(broken)
    assert tree(root) == before
    assert {path: (root / path).stat().st_ino for path in kept if "0001" not in path} == {
        path: number for path, number in kept.items() if "0001" not in path
    }, "whole samples were not made again"


def test_everything_but_the_plan_is_damaged_at_once(tmp_path: Path, copy_small: Copy) -> None:
    root = copy_small("depth", tmp_path / "data")
    before = tree(root)
    for relative in before:
        if not relative.endswith("plan.json"):
            flip(root / relative, 0.5)
    assert repaired(root).is_whole
    assert tree(root) == before


@pytest.mark.parametrize("change", [0x01, 0x5A])
def test_every_file_is_damaged_at_once(change: int, tmp_path: Path, copy_small: Copy, patch: Path) -> None:
    root = copy_small("semseg", tmp_path / "data", patch=patch, probes=True)
    before = tree(root)
    for number, (relative, data) in enumerate(before.items()):
        place = 37 * number % len(data)
        (root / relative).write_bytes(data[:place] + bytes([data[place] ^ change]) + data[place + 1 :])
    report = gear.verify(root)
    assert {(one.path, one.problem) for one in report.findings} == {(path, "damaged") for path in before}
    assert repaired(root, patch=patch).is_whole and tree(root) == before


def test_files_that_no_readable_file_lists_are_named(tmp_path: Path, copy_small: Copy, patch: Path) -> None:
    root = copy_small("depth", tmp_path / "data", patch=patch, probes=True)
    (root / "mine").mkdir()
    (root / "mine/notes.txt").write_text("mine")
    files = tree(root)
    for relative in files:
        (root / relative).write_bytes(b"")
    report = gear.verify(root)
    assert {one.path for one in report.findings} == set(files) and report.files == len(files)
    assert "unchecked  mine/notes.txt (the files that list it are damaged)" in report.lines()
    report = repaired(root)
    assert "neither the plan nor the manifest" in report.unrepaired[0]
    assert {one.path for one in report.repaired} == set(CARDS)


def test_a_note_on_a_sample_that_failed_is_checked_and_made_again(tmp_path: Path, copy_small: Copy) -> None:
    root = copy_small("depth", tmp_path / "data")
    before, note = tree(root), "gear/debug/failed/000001.json"
    for relative in ("samples/000001.json", "manifest.json"):
        (root / "gear/debug" / relative).unlink()
    note_failure(root, "debug", Outcome(index=1, error="ValueError: broken", trace="line 1"), tries=2)
    assert note not in {one.path for one in gear.verify(root).findings}
    flip(root / note, 0.4)
    assert (note, "damaged") in {(one.path, one.problem) for one in gear.verify(root).findings}
    report = repaired(root)
    assert report.is_whole and note in {one.path for one in report.repaired} and tree(root) == before


@pytest.mark.parametrize("name", ["plan.json", "manifest.json"])
@pytest.mark.parametrize("place", [0.2, 0.999, None])
def test_plan_and_manifest_repair_each_other(name: str, place: float | None, tmp_path: Path, copy_small: Copy) -> None:
    root = copy_small("depth", tmp_path / "data")
    before = tree(root)
    path = root / "gear/debug" / name
    path.unlink() if place is None else flip(path, place)
    assert not gear.verify(root).is_whole
    assert repaired(root).is_whole
    assert tree(root) == before


@pytest.mark.parametrize("seed", [1, 3, None])
def test_plan_and_manifest_damaged_by_several_bytes(
    seed: int | None, tmp_path: Path, copy_small: Copy, patch: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Both get their original bytes; if both lost the recipe, one line refuses, without advice to replace anything."""
    root = copy_small("depth", tmp_path / "data", patch=patch)
    before, rng = tree(root), np.random.default_rng(seed)
    for name, recipe in (("plan.json", "recipe"), ("manifest.json", "config")):
        for place in rng.uniform(0, 1, 2 if seed is None else 2 + seed):
            flip(root / "gear/debug" / name, place)
        if seed is None:
            edited = (root / "gear/debug" / name).read_bytes().replace(f'\n "{recipe}": {{'.encode(), b"\n")
            (root / "gear/debug" / name).write_bytes(edited)
    flip(root / "gear/debug/samples/000001.json", 0.5)
    report = repaired(root)
    assert report.is_whole == (tree(root) == before) == (seed is not None), report.unrepaired
    if not report.is_whole:
        assert main(["verify", str(root), "--repair"]) == 1
        said = capsys.readouterr()
        assert "delete both files and run the same `gear collect` again" in said.out + said.err
        assert "--force" not in said.out + said.err and "replace" not in said.out + said.err


def test_a_dataset_without_cards_is_whole_and_a_repair_writes_them(tmp_path: Path, copy_small: Copy) -> None:
    root = copy_small("depth", tmp_path / "data")
    before = tree(root)
    for name in CARDS:
        (root / name).unlink()
    assert gear.verify(root).is_whole and tree(root).keys() == before.keys() - set(CARDS)
    assert repaired(root).is_whole and tree(root) == before


def test_a_damaged_patch_is_taken_from_where_it_is_named(tmp_path: Path, copy_small: Copy, patch: Path) -> None:
    root = copy_small("depth", tmp_path / "data", patch=patch)
    before = tree(root)
    (copy,) = root.glob("gear/patches/*/patch_0.png")
    copy.write_bytes(b"")
    report = repaired(root)
    assert not report.is_whole and "name the patch with --patch" in report.lines()[1]
    assert repaired(root, patch=patch).is_whole
    assert tree(root) == before


def test_what_does_not_belong_there_is_reported_and_stays(tmp_path: Path, copy_small: Copy) -> None:
    root = copy_small("semseg", tmp_path / "data")
    (root / "README.md").write_text("mine")
    (root / "gear/scratch").mkdir()
    (root / "gear/scratch/oldhost-77-1.part").write_bytes(b"half")
    folder = next(path for path in root.rglob("*.png")).parent
    (folder / "stray.png").write_bytes(b"stray")
    (folder / ".hidden").write_bytes(b"")
    report = repaired(root)
    stray = (folder / "stray.png").relative_to(root).as_posix()
    assert report.findings == (Finding(path=stray, problem="unexpected"),)
    assert (folder / "stray.png").exists() and not (root / "gear/scratch").exists()


def test_a_note_on_the_failure_of_a_sample_that_exists_is_left_over(tmp_path: Path, copy_small: Copy) -> None:
    root = copy_small("depth", tmp_path / "data")
    notes = root / "gear/debug/failed"
    notes.mkdir()
    for index in (0, 1):
        (notes / f"{index:06d}.json").write_text("{}")
    (root / "gear/debug/samples/000001.json").unlink()
    found = {one.path: one.problem for one in gear.verify(root).findings}
    assert found == {"gear/debug/failed/000000.json": "unexpected", "gear/debug/samples/000001.json": "missing"}
    assert repaired(root).is_whole and not notes.exists()


def test_an_unfinished_split_is_finished(tmp_path: Path, copy_small: Copy) -> None:
    root = copy_small("depth", tmp_path / "data")
    before = tree(root)
    (root / "gear/debug/manifest.json").unlink()
    (root / "gear/debug/samples/000001.json").unlink()
    assert [one.problem for one in gear.verify(root).findings] == ["missing", "missing"]
    assert repaired(root).is_whole and tree(root) == before


def test_what_would_be_made_otherwise_is_left_alone(
    tmp_path: Path, copy_small: Copy, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = copy_small("depth", tmp_path / "data")
    flip(next(root.rglob("*.png")), 0.5)
    damaged = tree(root)
    monkeypatch.setattr("gear.collecting.job.versions", lambda: {"gear": "0.0.1"})
    report = repaired(root)
    assert "would differ if it were made on this machine (content.versions" in report.unrepaired[0]
    assert len(report.findings) == 1 and tree(root) == damaged


def test_the_command_has_lines_and_json_and_an_exit_code(
    tmp_path: Path, copy_small: Copy, capsys: pytest.CaptureFixture[str]
) -> None:
    root = copy_small("depth", tmp_path / "data")
    assert main(["verify", str(root)]) == 0
    assert capsys.readouterr().out.endswith("files, all as they were written\n")
    picture = next(root.rglob("*.png"))
    flip(picture, 0.5)
    assert main(["verify", str(root)]) == 1
    first, last = capsys.readouterr().out.splitlines()
    assert first == f"damaged    {picture.relative_to(root)}" and last.startswith(f"{root}: 1 damaged of")
    assert main(["verify", str(root), "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["findings"][0]["problem"] == "damaged"
    town = ["--town", str(TINY_TOWN), "--scenes", str(TINY_SCENES)]
    assert main(["verify", str(root), "--repair"]) == 1
    assert "no town named 'tiny'" in capsys.readouterr().out
    assert main(["verify", str(root), "--repair", *town]) == 0
    assert capsys.readouterr().out.startswith(f"repaired   {picture.relative_to(root)}\n")
    assert main(["verify", str(tmp_path)]) == 2
    assert main(["verify", str(root), "--split", "nowhere"]) == 2


def test_damage_is_not_passed_over_by_what_reads_it(
    tmp_path: Path, collected: Collected, install: Install, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = collected("semseg", probes=True)
    for suffix in (".png", ".json"):
        root = Path(shutil.copytree(whole, tmp_path / f"data{suffix}"))
        victim = next(path for path in sorted(root.rglob(f"*{suffix}")) if "gear/" not in path.as_posix())
        flip(victim, 0.5)
        dataset = gear.open_dataset(root)
        with pytest.raises(DatasetError, match=r"is damaged: .*; `gear verify DIR --repair` makes it again"):
            list(dataset)
        sheet, page = str(tmp_path / "sheet.png"), str(tmp_path / "view.html")
        model = ["--model", "tiny_segmenter", "--data", str(root), "--out", str(tmp_path / f"out{suffix}")]
        for command in (
            ["sheet", str(root), "--out", sheet],
            ["view", str(root), "--out", page],
            ["evaluate", *model],
            ["attack", *model, "--steps", "1", "--allow-test-data", "--set", "height_px=12", "--set", "width_px=24"],
        ):
            capsys.readouterr()
            assert main(command) in (1, 2), command
            said = capsys.readouterr()
            assert "is damaged" in said.out + said.err


def test_a_collection_does_not_pass_over_damage(tmp_path: Path, copy_small: Copy, collect_small: object) -> None:
    root = copy_small("depth", tmp_path / "data")
    before = tree(root)
    picture = next(root.rglob("*.png"))
    flip(picture, 0.5)
    with pytest.raises(DatasetError, match=r"is not as it was written; `gear verify DIR --repair` makes it again"):
        collect_small("depth", root)  # type: ignore[operator]
    picture.unlink()
    collect_small("depth", root)  # type: ignore[operator]
    assert tree(root) == before
    flip(root / "gear/debug/plan.json", 0.5)
    with pytest.raises(DatasetError, match=r"plan.json: is (damaged|not JSON)") as caught:
        collect_small("depth", root)  # type: ignore[operator]
    assert "--force" not in str(caught.value) and "gear verify DIR --repair" in str(caught.value)


def test_a_split_of_ones_own_simulation_config_is_repaired_where_that_lies(
    tmp_path: Path, collect_small: Callable[..., Any]
) -> None:
    config = tmp_path / "mine.yml"
    config.write_text("splits:\n  odd: {seed: 5, samples: 1, frames: 2, interval_s: 0.5}\nmax_vehicles: 3\n")
    root = tmp_path / "data"
    collect_small("depth", root, split="odd", samples=1, settings=[f"simulation={config}"])
    before = tree(root)
    moved = config.rename(tmp_path / "moved.yml")
    next(root.rglob("*.png")).unlink()
    report = repaired(root)
    assert not report.is_whole and "with --town, --scenes and --simulation" in report.lines()[1]
    assert repaired(root, simulation=moved).is_whole
    assert tree(root) == before


def test_sources_are_looked_at_only_for_a_repair(tmp_path: Path, copy_small: Copy) -> None:
    root = copy_small("depth", tmp_path / "data")
    assert module.verify(root, patch=tmp_path / "nowhere").is_whole
    assert Sources() == Sources(patch=None, town=None, scenes=None, simulation=None)
