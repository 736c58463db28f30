"""`gear evaluate` over several datasets: twins compared and tested, rows together, metrics outside the patch."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gear
from gear.measuring.patch_area import patch_masks
from gear.metrics.depth import DepthEvaluator
from gear.plugins.tasks.depth import DepthTask
from gear.testing.tiny_networks import tiny_segmenter
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import DatasetError, GearError
from gear.verbs.collect.run import collect
from gear.verbs.evaluate.pools import check_pools
from gear.verbs.evaluate.request import EvaluateRequest
from gear.verbs.evaluate.run import evaluate, run_evaluate
from tests.shared import ClockedLines
from tests.verbs.conftest import Install, Small, size_settings
from tests.verbs.evaluate.conftest import Oracle, model_spec


def test_twins_are_compared_and_the_patch_can_be_left_out(tmp_path: Path, small: Small, install: Install) -> None:
    """A network that is wrong on the random patch alone."""
    roots = [small("semseg", "none"), small("semseg", "random")]

    def fooled(sample: Any, prediction: Any) -> Any:
        is_patched = (
            gear.open_dataset(roots[1])[sample.record.index].images["left"].tobytes() == sample.images["left"].tobytes()
        )
        return np.where(patch_masks(sample)["left"] & is_patched, np.uint8(26), prediction)

    install(model_spec(lambda _: Oracle(roots, fooled), "semseg"))
    report = evaluate(roots, model="odd", out=tmp_path / "out", reports=["outside_patch"])
    none, random = report.row("none"), report.row("random")
    assert none.metrics["task"]["miou"].value == 1
    # The board is "static" in Cityscapes, which is not evaluated: nothing is lost by being wrong there.
    board = {p for s in gear.open_dataset(roots[0]) for p in np.unique(s.label_ids[patch_masks(s)["left"]]).tolist()}
    assert board == {4} and random.metrics["task"]["miou"].value == 1
    (difference,) = report.differences
    assert (difference.row, difference.against) == (random.name, none.name)
    assert difference.metrics["task"]["miou"].value == 0 and difference.auroc is None
    assert {name: (test["miou"].mean, test["miou"].p) for name, test in difference.paired.items()} == {
        "task": (0, 1), "outside_patch": (0, 1),
    }  # fmt: skip


def test_the_closing_of_an_evaluation_has_rate_and_time_left(
    tmp_path: Path, small: Small, install: Install, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two sheets, two rows and one comparison."""
    roots = [small("semseg", "none"), small("semseg", "random")]
    install(model_spec(lambda _: Oracle(roots), "semseg"))
    lines = ClockedLines(monkeypatch, "evaluate")
    run_evaluate(EvaluateRequest(data=tuple(roots), model="odd", out=tmp_path / "out"), lines.callbacks)
    told = [line.partition("intervals, ")[2] for line in lines.counted("computing metrics and intervals")]
    assert [line.partition(",")[0] for line in told] == [f"{done} of 5" for done in range(6)]
    assert told[2] == "2 of 5, 6 per minute, 30 seconds left"


def test_pools_are_datasets_that_count_as_one(tmp_path: Path, small: Small, install: Install) -> None:
    """Two metres too far on the patched pictures, one on those with the random patch; two seeds of each."""
    roots: dict[str, list[Path]] = {"none": [], "random": []}
    for seed in (1, 2):
        for patch, found in roots.items():
            found.append(tmp_path / f"{patch}-{seed}")
            collect(
                "depth", town=TINY_TOWN, scene="board", split="debug", samples=2 * seed, seed=seed, renderer="classic",
                quality="fast", patch=patch, out=found[-1],
                settings=[f"scenes={TINY_SCENES}", *size_settings("depth")],
            )  # fmt: skip
    every = [*roots["none"], *roots["random"]]
    patched = {hash(s.images["left"].tobytes()) for root in roots["random"] for s in gear.open_dataset(root)}
    install(
        model_spec(
            lambda _: Oracle(every, lambda s, p: p + (1 + (hash(s.images["left"].tobytes()) in patched))), "depth"
        )
    )
    pools = {"none": roots["none"], "random": roots["random"], "first": roots["random"][:1]}
    report = evaluate(every, model="odd", out=tmp_path / "out", pools=pools)
    none, random, first = report.pools
    assert (none.name, none.samples, none.differences) == ("none", 6, ())
    assert none.rows == tuple(row.name for row in report.rows[:2])
    assert [one.metrics["task"]["mae_m"].value for one in report.pools] == pytest.approx([1, 2, 2], rel=1e-5)
    (change,) = random.differences
    assert (change.row, change.against) == ("random", "none") and change.paired["task"]["mae_m"].pairs == 6
    assert change.metrics["task"]["mae_m"].value == pytest.approx(1, rel=1e-5)
    assert first.differences == (), "it shows fewer scenes than the others"
    assert json.loads((tmp_path / "out/results.json").read_text())["pools"][1] == random.as_json()
    for wrong, said in (({"none": []}, "'none' holds no dataset"), ({"a": [tmp_path / "no"]}, "not among the data")):
        with pytest.raises(GearError, match=said):
            evaluate(every, model="odd", out=tmp_path / "wrong", pools=wrong)


def test_a_street_in_two_weathers_is_no_two_streets(tmp_path: Path, install: Install) -> None:
    """The network errs by the street, whatever the weather: the second weather says nothing that the first does not."""
    roots: dict[tuple[str, str], Path] = {}
    for weather in ("ClearNoon", "CloudyNoon"):
        for patch in ("none", "random"):
            roots[weather, patch] = tmp_path / f"{weather}-{patch}"
            collect(
                "depth", town=TINY_TOWN, scene="board", split="debug", samples=4, seed=3, renderer="classic",
                quality="fast", patch=patch, out=roots[weather, patch],
                settings=[f"scenes={TINY_SCENES}", f"weather={weather}", *size_settings("depth")],
            )  # fmt: skip
    every = list(roots.values())
    patched = {Oracle.key(s.images) for (_, patch), r in roots.items() if patch != "none" for s in gear.open_dataset(r)}

    def by_street(sample: Any, prediction: Any) -> Any:
        return prediction + 1 + (2 + sample.record.index**2) * (Oracle.key(sample.images) in patched)

    install(model_spec(lambda _: Oracle(every, by_street), "depth"))
    pools = {patch: [roots[weather, patch] for weather in ("ClearNoon", "CloudyNoon")] for patch in ("none", "random")}
    report = evaluate(every, model="odd", out=tmp_path / "out", pools=pools)
    one, whole = report.differences[0], report.pools[1].differences[0]
    assert one.paired["task"]["mae_m"].p == whole.paired["task"]["mae_m"].p == 2 / 2**4
    assert whole.paired["task"]["mae_m"].pairs == 8
    together = next(row for row in report.together if row.patch == "random")
    alone = report.rows[1].metrics["task"]["mae_m"].interval
    assert alone is not None and alone[0] < alone[1] - 1
    for metrics in (report.pools[1].metrics, together.metrics, whole.metrics):
        wanted = one.metrics["task"]["mae_m"].interval if metrics is whole.metrics else alone
        assert metrics["task"]["mae_m"].interval == pytest.approx(wanted, rel=1e-3)


def test_a_pool_counts_nothing_twice_and_leaves_nothing_out(tmp_path: Path) -> None:
    """Samples that count twice make intervals too narrow, and of two splits in one root the last one alone counted."""
    one, other = tmp_path / "one", tmp_path / "other"
    check_pools({"a": [one, other], "b": [one]}, [one, other])
    with pytest.raises(GearError, match=r"pool 'a' holds .*one twice"):
        check_pools({"a": [one, other, tmp_path / "other/../one"]}, [one, other])
    with pytest.raises(GearError, match=r"pool 'b' holds .*other, of which several splits"):
        check_pools({"a": [one], "b": [other]}, [one, other, other])


def test_datasets_of_one_label_have_a_row_together(tmp_path: Path, small: Small, install: Install) -> None:
    """Right on one dataset, a metre too far on the other: together they are as if they were one."""
    other = tmp_path / "other"
    collect(
        "depth", town=TINY_TOWN, scene="board", split="debug", samples=1, seed=77, renderer="classic", quality="fast",
        patch="none", out=other, settings=[f"scenes={TINY_SCENES}", *size_settings("depth")],
    )  # fmt: skip
    roots = [small("depth", "none"), other]
    seeds = [gear.open_dataset(root).plan.info.seed for root in roots]
    install(model_spec(lambda _: Oracle(roots, lambda s, p: p + (s.record.seed == seeds[1])), "depth"))

    report = evaluate(roots, model="odd", out=tmp_path / "out")

    whole = gear.open_dataset(other).task.evaluator()
    for root, error_m in zip(roots, (0, 1), strict=True):
        dataset = gear.open_dataset(root)
        for sample in dataset:
            whole.update(sample, dataset.task.as_prediction(sample) + error_m)
    (pooled,) = report.together
    assert (pooled.patch, pooled.samples, pooled.rows) == ("none", 3, tuple(row.name for row in report.rows))
    metrics = pooled.metrics["task"]
    assert {name: one.value for name, one in metrics.items()} == pytest.approx(dict(whole.result()), nan_ok=True)
    assert metrics["mae_m"].interval is not None and metrics["mae_m"].interval[0] < metrics["mae_m"].value
    assert "all with patch none" in (tmp_path / "out" / "table.txt").read_text()
    alone = evaluate(roots[:1], model="odd", out=tmp_path / "alone")
    assert alone.together == ()
    for number, root in enumerate(roots):
        (tmp_path / "all" / "depth").mkdir(parents=True, exist_ok=True)
        (tmp_path / "all" / "depth" / str(number)).symlink_to(root)
    again = evaluate(tmp_path / "all", model="odd", out=tmp_path / "folder")
    assert [row.name for row in again.rows] == [row.name for row in report.rows], "a folder of datasets is all of them"
    with pytest.raises(DatasetError, match="is not a dataset of gear's"):
        evaluate(tmp_path / "out", model="odd", out=tmp_path / "none")


def test_twins_are_tested_sample_by_sample(tmp_path: Path, small: Small, install: Install) -> None:
    """A network that the random patch leads astray by a metre a sample, on the patch alone in one report."""
    roots = [small("depth", "none", 3), small("depth", "random", 3)]
    patched = {Oracle.key(sample.images) for sample in gear.open_dataset(roots[1])}

    def astray(sample: Any, prediction: Any) -> Any:
        far = np.float32(1 + sample.record.index if Oracle.key(sample.images) in patched else 0)
        return np.where(patch_masks(sample)["left"], prediction, prediction + far)

    install(model_spec(lambda _: Oracle(roots, astray), "depth"))
    report = evaluate(roots, model="odd", out=tmp_path / "out", reports=["outside_patch"])
    (difference,) = report.differences
    test = difference.paired["outside_patch"]["mae_m"]
    assert (test.mean, test.p, test.pairs) == (pytest.approx(2, abs=1e-4), 2 / 8, 3)
    assert 0 < difference.paired["task"]["mae_m"].mean < test.mean
    written = json.loads((tmp_path / "out/results.json").read_text())["differences"][0]["paired"]
    assert written["outside_patch"]["mae_m"] == test.as_json()
    assert len(json.loads((tmp_path / "out/results.json").read_text())["rows"][0]["per_sample"][0]["metrics"]) == 2
    line = (tmp_path / "out/table.txt").read_text().splitlines()[-1]
    assert "minus none: mae_m +" in line and "outside_patch.mae_m +2.000 (p 0.25, 3 pairs)" in line


class Boundless(DepthEvaluator):
    """Somebody's metric, one of whose metrics is infinite where nothing is wrong."""

    def update(self, sample: Any, prediction: Any) -> Mapping[str, float]:
        return {**super().update(sample, prediction), "psnr_db": np.inf}

    def result(self) -> Mapping[str, float]:
        return {**super().result(), "psnr_db": np.inf if self.metrics else np.nan}

    def resampled(self, draws: Any) -> Mapping[str, Any]:
        return {**super().resampled(draws), "psnr_db": np.full(len(draws), np.inf)}


def test_one_sample_has_no_interval(tmp_path: Path, small: Small, install: Install) -> None:
    """It was drawn again and again, and the metric seemed certain to the last digit."""
    roots = [small("semseg", patch, samples=1) for patch in ("none", "random")]
    install(tiny_segmenter)
    report = evaluate(roots, model="tiny_segmenter", defense="lgs", out=tmp_path / "out")
    (difference,) = report.differences
    assert difference.auroc is not None and difference.auroc.interval is None
    for metrics in (report.rows[0].metrics["task"], report.rows[1].metrics["task"], difference.metrics["task"]):
        assert metrics["pixel_accuracy"].value == metrics["pixel_accuracy"].value
        assert all(one.interval is None for one in metrics.values())
    assert "[" not in (tmp_path / "out/table.txt").read_text()
    assert difference.paired["task"]["miou"].p == 1, "of one pair either sign is as far from 0"


def test_what_is_infinite_is_nothing_in_json(
    tmp_path: Path, small: Small, install: Install, monkeypatch: pytest.MonkeyPatch
) -> None:
    roots = [small("depth", "none"), small("depth", "random")]
    monkeypatch.setattr(DepthTask, "evaluator", lambda self: Boundless())
    install(model_spec(lambda _: Oracle(roots), "depth"))
    report = evaluate(roots, model="odd", out=tmp_path / "out")
    found = json.loads((tmp_path / "out/results.json").read_text())
    assert found["rows"][0]["metrics"]["task"]["psnr_db"] == {"value": None, "low": None, "high": None}
    (difference,) = report.differences
    assert difference.as_json()["metrics"]["task"]["psnr_db"]["value"] is None
    assert difference.as_json()["paired"]["task"]["psnr_db"] == {"mean": None, "p": None, "pairs": 0}
    assert difference.paired["task"]["mae_m"].pairs > 0


def test_frames_of_a_drive_are_not_taken_for_scenes_without_a_word(
    tmp_path: Path, small: Small, collect_small: Any, install: Install
) -> None:
    simulation, drive = tmp_path / "simulation.yaml", tmp_path / "drive"
    simulation.write_text("splits: {video: {seed: 60, samples: 2, frames: 3, interval_s: 0.2}}\n")
    collect_small("depth", drive, split="video", samples=2, settings=[f"simulation={simulation}"])
    roots = [drive, small("depth", "none")]
    install(model_spec(lambda _: Oracle(roots), "depth"))
    report = evaluate(roots, model="odd", out=tmp_path / "out")
    (note,) = report.as_json()["notes"]
    assert note.startswith(f"{drive}: 6 samples are frames of 2 drives")
    assert note in (tmp_path / "out" / "table.txt").read_text()


def test_metrics_outside_the_patch_do_not_see_it(tmp_path: Path, small: Small, install: Install) -> None:
    data = small("depth")

    def wrong_there(sample: Any, prediction: Any) -> Any:
        return np.where(patch_masks(sample)["left"], np.float32(3.0), prediction)

    install(model_spec(lambda _: Oracle([data], wrong_there), "depth"))
    (row,) = evaluate(data, model="odd", out=tmp_path / "out", reports=["outside_patch"]).rows
    assert row.metrics["task"]["rmse_m"].value > 0.1
    assert row.metrics["outside_patch"]["rmse_m"].value == 0
    low, high = row.metrics["task"]["rmse_m"].interval or (0, 0)
    assert low <= row.metrics["task"]["rmse_m"].value <= high
