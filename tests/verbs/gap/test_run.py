"""`gear gap`: the metrics, the report, the effect on a model, and what bad input gets."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

import gear
from gear.cli.main import main
from gear.collecting.patch_sources import read_patch
from gear.compositor.registry import open_compositor
from gear.measuring import plugin_selection
from gear.measuring.gap.picture_gap import PERFECT_DB, picture_gap
from gear.measuring.gap.run import sample_gaps, shown_patches
from gear.testing.tiny_networks import tiny_segmenter
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import DatasetError, GearError
from tests.verbs.conftest import Collected, Copy, Install


@pytest.fixture
def pair(tmp_path: Path, copy_small: Copy) -> tuple[Path, Path]:
    """A split with probes and its twin."""
    clean, twin = tmp_path / "clean", tmp_path / "twin"
    return copy_small("semseg", clean, probes=True), copy_small("semseg", twin, patch="random")


def test_metrics_tell_inside_from_outside() -> None:
    rng = np.random.default_rng(1)
    rendered = rng.integers(0, 200, (8, 10, 3), dtype=np.uint8)
    mask = np.zeros((8, 10), bool)
    mask[2:5, 3:7] = True
    assert picture_gap(rendered, rendered, mask).psnr_db == PERFECT_DB
    digital = rendered.copy()
    digital[mask] += 10
    digital[0, 0, 1] += 4
    gap = picture_gap(digital, rendered, mask)
    assert gap.psnr_db == pytest.approx(20 * np.log10(255 / 10))
    assert (gap.worst, gap.outside_worst, gap.outside_px) == (10, 4, 1)
    assert gap.outside_rms == pytest.approx(np.sqrt(16 / (68 * 3)))


def test_a_gap_is_reported_and_written(pair: tuple[Path, Path], tmp_path: Path) -> None:
    clean, twin = pair
    seen: list[tuple[int, int]] = []
    report = gear.gap(clean, twin=twin, out=tmp_path / "gap", on_progress=lambda *done: seen.append(done))
    assert seen == [(0, 2), (1, 2), (2, 2)]
    assert report.median_db("transport") > 40 > report.median_db("homography") + 6
    written = json.loads((tmp_path / "gap/gap.json").read_text())
    assert written["median_psnr_db"]["transport"] == report.median_db("transport")
    assert len(written["samples"]) == len(report.samples) == 2
    assert "transport dB" in (tmp_path / "gap/gap.txt").read_text()
    assert report.effect == {}


def test_a_patch_in_lamplight_is_composed_as_exactly(tmp_path: Path, copy_small: Copy) -> None:
    night = {"weather": "WetNight"}
    copy_small("semseg", tmp_path / "clean", probes=True, **night)
    copy_small("semseg", tmp_path / "twin", patch="random", **night)
    report = gear.gap(tmp_path / "clean", twin=tmp_path / "twin")
    assert report.median_db("transport") > 40
    copy_small("semseg", tmp_path / "day", patch="random")
    day, dark = (
        np.mean([sample.images["left"].mean() for sample in gear.open_dataset(tmp_path / name, split="debug")])
        for name in ("day", "twin")
    )
    assert dark < 0.6 * day


def test_a_models_metrics_are_taken_digitally_and_rendered(
    pair: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    owner = SimpleNamespace(package="mujoco-gear", version="0")
    monkeypatch.setattr(plugin_selection, "find", lambda kind, name: SimpleNamespace(spec=tiny_segmenter, owner=owner))
    clean, twin = pair
    report = gear.gap(clean, twin=twin, model="tiny", compositors=("transport",), samples=1)
    assert set(report.effect) == {"clean", "transport", "rendered"}
    assert report.effect["clean"].keys() == report.effect["rendered"].keys()
    metrics: Any = report.as_json()["rendered_share_of_digital_effect"]["transport"]
    assert all(value is None or isinstance(value, float) for value in metrics.values())
    assert "rendered / digital" in report.table()
    (alone,) = report.sample_effects
    assert alone.index == 0 and alone.change.keys() == {"transport", "rendered"}
    metric = report.shown_metric()
    # One sample: its own metric is the whole's, and so is what the patch changes of it.
    for way, change in alone.change.items():
        assert alone.clean[metric] == pytest.approx(report.effect["clean"][metric])
        assert change[metric] == pytest.approx(report.effect[way][metric] - report.effect["clean"][metric])
    assert f"{change[metric]:+.4f}" in report.table()


def test_what_a_defense_learnt_is_reported(pair: tuple[Path, Path], collected: Collected, install: Install) -> None:
    install(tiny_segmenter)
    clean, twin = pair
    report = gear.gap(
        clean, twin=twin, model="tiny_segmenter", compositors=("transport",), samples=1, defense="fpda",
        defense_settings=["false_alarms=0.2"],
        calibration=collected("semseg", "calibration", scene="board", split="val", samples=8),
    )  # fmt: skip
    assert report.fit is not None and report.fit.values["clean_pictures"] == 8
    assert report.as_json()["fit"]["values"] == report.fit.values
    assert "fpda learnt, on its own calibration data: clean_pictures 8, level" in report.table()
    doubtful = replace(report, fit=replace(report.fit, problems=("learnt nothing",)))
    assert doubtful.table().endswith("WARNING: learnt nothing")


def test_a_model_sees_what_is_pasted_over_a_hidden_board(pair: tuple[Path, Path]) -> None:
    """The paper's compositor knows nothing of what stands before a board; there is no gap to measure inside of it."""
    clean, twin = (gear.open_dataset(root) for root in pair)
    hidden: Any = replace(twin[0], surfaces=tuple(replace(one, visible_px=0) for one in twin[0].surfaces))
    shown: dict[str, Any] = {}
    effect: Any = SimpleNamespace(update=lambda index, untouched, pictures: shown.update(pictures))
    engines = {"homography": open_compositor("homography", clean, rounding=True)}
    pairs: Any = [(clean[0], hidden)]
    assert sample_gaps(pairs, engines, shown_patches(twin, 1), 0, effect) == []
    pasted = (shown["homography"].images["left"] != clean[0].images["left"]).any(axis=2)
    assert pasted.sum() > 0.9 * twin[0].surfaces[0].visible_px


def test_what_does_not_suit_is_said_before_anything_is_rendered(pair: tuple[Path, Path], tmp_path: Path) -> None:
    clean, _ = pair
    places: dict[str, Any] = {"town": TINY_TOWN, "scenes": TINY_SCENES, "out": tmp_path / "gap", "patch": "random"}
    with pytest.raises(GearError, match="is a semseg dataset"):
        gear.gap(clean, model="glpdepth", **places)
    with pytest.raises(GearError, match="name one with --model"):
        gear.gap(clean, defense="median", **places)
    with pytest.raises(GearError, match="defense"):
        gear.gap(clean, model="ddrnet23_slim", model_settings=["weights=random"], defense="no_such", **places)
    with pytest.raises(DatasetError, match="has 1 surfaces for patches, none has 0; give one for each"):
        gear.gap(clean, **{**places, "patch": "none"})
    with pytest.raises(DatasetError, match="samples must be at least 1"):
        gear.gap(clean, **places, samples=0)
    assert not (tmp_path / "gap").exists()


def test_a_split_without_probes_is_an_error_before_its_twin_is_rendered(tmp_path: Path, copy_small: Copy) -> None:
    copy_small("semseg", tmp_path / "clean")
    places: dict[str, Any] = {"town": TINY_TOWN, "scenes": TINY_SCENES, "out": tmp_path / "gap", "patch": "random"}
    with pytest.raises(DatasetError, match="has no probes"):
        gear.gap(tmp_path / "clean", **places)
    assert not (tmp_path / "gap").exists()
    report = gear.gap(tmp_path / "clean", **places, compositors=("homography",))
    assert len(report.samples) == 2, "what needs none does without"


def test_a_twin_that_is_refused_leaves_no_folder(pair: tuple[Path, Path], tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="shows 0 patches"):
        gear.gap(pair[0], twin=pair[0], out=tmp_path / "gap")
    assert not (tmp_path / "gap").exists()


def test_the_command_prints_a_table_or_json(pair: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    clean, twin = pair
    assert main(["gap", str(clean), "--twin", str(twin), "--compositor", "transport"]) == 0
    assert "median" in capsys.readouterr().out
    assert main(["gap", str(clean), "--twin", str(twin), "--json", "--samples", "1"]) == 0
    assert json.loads(capsys.readouterr().out)["median_psnr_db"]["transport"] > 40


def test_what_cannot_be_compared_is_refused(pair: tuple[Path, Path], tmp_path: Path, copy_small: Copy) -> None:
    clean, twin = pair
    with pytest.raises(DatasetError, match="say one of: --twin DIR"):
        gear.gap(clean)
    with pytest.raises(DatasetError, match="say where to with --out"):
        gear.gap(clean, patch="random")
    with pytest.raises(DatasetError, match="shows 0 patches"):
        gear.gap(clean, twin=clean)
    with pytest.raises(DatasetError, match="shows the patch random itself"):
        gear.gap(twin, twin=clean)
    with pytest.raises(DatasetError, match="collect the twin yourself"):
        gear.gap(clean, patch="random", out=tmp_path / "gap")
    copy_small("semseg", tmp_path / "other", patch="random", seed=9)
    with pytest.raises(DatasetError, match="is no twin"):
        gear.gap(clean, twin=tmp_path / "other")
    with pytest.raises(GearError, match="is a semseg dataset"):
        gear.gap(clean, twin=twin, model="glpdepth")
    with pytest.raises(DatasetError, match="name it with --model"):
        gear.gap(clean, twin=twin, model_settings=["weights=none"])
    with pytest.raises(DatasetError, match="is a dataset; write the gap into a folder of its own"):
        gear.gap(clean, twin=twin, out=clean)
    (tmp_path / "file").write_text("x")
    with pytest.raises(DatasetError, match="a file is where a folder should be"):
        gear.gap(clean, twin=twin, out=tmp_path / "file")
    copy = twin / "gear/patches/random/patch_0.png"
    copy.write_bytes(cv2.imencode(".png", read_patch(copy)[:, ::-1])[1].tobytes())
    with pytest.raises(DatasetError, match="is not what the pictures show"):
        gear.gap(clean, twin=twin)


def test_the_twin_of_another_gap_stays(pair: tuple[Path, Path], tmp_path: Path) -> None:
    places: dict[str, Any] = {"town": TINY_TOWN, "scenes": TINY_SCENES, "out": tmp_path / "gap"}
    gear.gap(pair[0], patch="random", **places)
    cv2.imwrite(str(tmp_path / "grey.png"), np.full((20, 40, 3), 90, np.uint8))
    with pytest.raises(DatasetError, match="is another gap's twin, with the patch random; use another --out"):
        gear.gap(pair[0], patch=tmp_path / "grey.png", **places)


def test_the_twin_of_a_users_town_is_rendered(pair: tuple[Path, Path], tmp_path: Path) -> None:
    """As much of it as is looked at: a later look at more completes it, one at less takes it as it is."""
    clean, twin = pair
    places: dict[str, Any] = {"town": TINY_TOWN, "scenes": TINY_SCENES, "out": tmp_path / "gap"}
    names = sorted(path.name for path in twin.rglob("*_leftImg8bit.png"))
    assert len(names) == 2
    for samples, there in ((1, names[:1]), (None, names), (1, names)):
        report = gear.gap(clean, patch="random", **places, samples=samples)
        assert report.median_db("transport") > 40 and len(report.samples) == (samples or 2)
        assert sorted(path.name for path in (tmp_path / "gap/twin").rglob("*_leftImg8bit.png")) == there
    for name in names:
        (there,), (made,) = twin.rglob(name), (tmp_path / "gap/twin").rglob(name)
        assert made.read_bytes() == there.read_bytes()


@pytest.mark.slow
def test_the_twin_of_a_shipped_town_is_rendered_on_demand(tmp_path: Path) -> None:
    settings = ["options.width_px=256", "options.height_px=128"]
    gear.collect(
        "semseg", split="train", samples=1, renderer="classic", quality="fast", probes=True, settings=settings,
        out=tmp_path / "clean",
    )  # fmt: skip
    report = gear.gap(tmp_path / "clean", patch="random", out=tmp_path / "gap")
    assert report.patch == "random" and (tmp_path / "gap/twin/gear/train/manifest.json").is_file()
    assert report.median_db("transport") > 40
