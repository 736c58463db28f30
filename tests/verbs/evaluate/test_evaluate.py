"""`gear evaluate` on tiny datasets: metrics, files, resuming, defenses, and who is blamed."""

from __future__ import annotations

import contextlib
import copy
import importlib
import io
import json
import re
import sys
import types
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import torch

import gear
from gear.cli.main import main
from gear.contracts.defenses import DefenseResult
from gear.contracts.specs import DefenseSpec
from gear.formats.kitti_object import parse_labels
from gear.measuring.patch_area import patch_masks
from gear.networks.weights import write as write_weights
from gear.testing.tiny_networks import tiny_depth, tiny_segmenter
from gear.values.errors import ConfigError, DatasetError, FieldError, GearError, PluginError, UnknownNameError
from gear.verbs.evaluate.run import evaluate
from tests.verbs.conftest import Install, Small
from tests.verbs.evaluate.conftest import Config, Oracle, Views, model_spec

HEADLINES = {"semseg": ("miou", 1), "depth": ("rmse_m", 0), "detect2d": ("ap", 1), "stereo3d": ("car_2d_easy_r40", 1)}


def timeless(path: Path) -> Any:
    def strip(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: strip(item) for key, item in value.items() if key not in ("model_s", "defense_s", "cost")}
        return [strip(item) for item in value] if isinstance(value, list) else value

    return strip(json.loads((path / "results.json").read_text()))


@pytest.mark.parametrize("task", HEADLINES)
def test_the_truth_scores_perfect_and_is_kept_in_the_formats_layout(
    tmp_path: Path, small: Small, install: Install, task: str
) -> None:
    data = small(task)
    install(model_spec(lambda _: Oracle([data]), task))
    report = evaluate(data, model="odd", out=tmp_path / "out", reports=["reference"])
    (row,) = report.rows
    assert (row.samples, row.made) == (2, 2)
    metric, perfect = HEADLINES[task]
    if task != "stereo3d":  # two pictures have too few labels for forty recall steps
        assert row.metrics["task"][metric].value == pytest.approx(perfect)
    assert "reference" in row.metrics
    folder = tmp_path / "out" / row.name / "predictions"
    dataset = gear.open_dataset(data)
    for index, sample in enumerate(dataset):
        truth = dataset.task.as_prediction(sample)
        if task == "semseg":
            paths = sorted(folder.rglob(f"*_{index:06d}_000000*.png"))
            assert len(paths) == 1 and np.array_equal(cv2.imread(str(paths[0]), cv2.IMREAD_UNCHANGED), truth)
        elif task == "depth":
            units = cv2.imread(str(folder / f"depth/rgb_{index:04d}.png"), cv2.IMREAD_UNCHANGED)
            near = truth < 255
            assert units.dtype == np.uint16 and np.abs(units[near] / 256 - truth[near]).max() <= 1 / 512
        elif task == "stereo3d":
            assert parse_labels((folder / f"data/{index:06d}.txt").read_text()) == truth
        else:
            lines = json.loads((folder / "coco_results_debug.json").read_text())
            found = [one for one in lines if one["image_id"] == index + 1]
            assert [(o["category_id"], o["bbox"][0]) for o in found] == [(t.category_id, t.box_px[0]) for t in truth]
    assert json.loads((tmp_path / "out/results.json").read_text())["rows"][0]["samples"] == 2
    assert (tmp_path / "out/table.txt").read_text().startswith(f"{task}: odd\n")
    assert not (tmp_path / "out/gear").exists()


@pytest.mark.parametrize("task", HEADLINES)
def test_it_is_taken_up_again_and_predicts_nothing_twice(
    tmp_path: Path, small: Small, install: Install, task: str
) -> None:
    data = small(task, samples=3)
    oracle = Oracle([data])
    install(model_spec(lambda _: oracle, task))

    noted: list[int] = []

    def count(finished: int, total: int) -> None:
        noted.append(finished)

    folder = tmp_path / "out"
    evaluate(data, model="odd", out=tmp_path / "whole", reports=["reference"], on_progress=count)
    assert noted == [0, 1, 2, 3]
    evaluate(data, model="odd", out=folder, reports=["reference"])
    (row,) = sorted(path for path in folder.iterdir() if (path / "samples").is_dir())
    (row / "samples/000001.json").unlink()
    (folder / "results.json").unlink()
    oracle.shown = 0
    report = evaluate(data, model="odd", out=folder, reports=["reference"])
    assert report.rows[0].made == 1 and oracle.shown == 1
    assert timeless(folder) == timeless(tmp_path / "whole")
    with pytest.raises(DatasetError, match=r"something else \(seed: 0 there, 1 now\)"):
        evaluate(data, model="odd", out=folder, seed=1)


@pytest.mark.parametrize("damage", ["note", "half", "key", "prediction"])
def test_a_damaged_result_is_predicted_again_with_a_warning(
    tmp_path: Path, small: Small, install: Install, capsys: pytest.CaptureFixture[str], damage: str
) -> None:
    data = small("depth")
    install(model_spec(lambda _: Oracle([data]), "depth"))
    out = tmp_path / "out"
    first, whole = evaluate(data, model="odd", out=out), timeless(out)
    (row,) = sorted(path for path in out.iterdir() if (path / "samples").is_dir())
    note = row / "samples/000001.json"
    (row / "samples/notes-of-mine.json").write_text("[]")
    if damage == "prediction":
        for path in (row / "predictions").rglob("*0001*"):
            path.write_bytes(b"half")
    else:
        note.write_text({"note": "[]", "half": note.read_text()[:40], "key": '{"index": 1}'}[damage])
    again = evaluate(data, model="odd", out=out)
    assert again.rows[0].made == 1 and again.rows[0].metrics == first.rows[0].metrics
    (told,) = again.rows[0].damaged
    assert str(row) in told and "0001" in told
    assert timeless(out) == whole
    assert evaluate(data, model="odd", out=out).rows[0].made == 0
    note.write_text("[]")
    assert main(["evaluate", "--model", "odd", "--data", str(data), "--out", str(out)]) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"gear: note: {note}: is not the stored result of a sample") and "predicted again" in line


@pytest.mark.parametrize("damaged", [lambda text: "", lambda text: text[: len(text) // 2], lambda text: "é"])
def test_a_shortened_result_is_not_taken_for_fewer_detections(
    tmp_path: Path, small: Small, install: Install, damaged: Callable[[str], str]
) -> None:
    data = small("stereo3d", samples=3)
    install(model_spec(lambda _: Oracle([data]), "stereo3d"))
    out = tmp_path / "out"
    evaluate(data, model="odd", out=out)
    whole = timeless(out)
    path = max(out.glob("*/predictions/data/*.txt"), key=lambda path: path.stat().st_size)
    path.write_bytes(damaged(path.read_text()).encode("latin-1"))
    again = evaluate(data, model="odd", out=out)
    assert again.rows[0].made == 1 and str(path) in again.rows[0].damaged[0]
    assert timeless(out) == whole


ABSURD = {"detections": [{"category_id": -1, "box_px": [0.0, 0.0, 1.0, 1.0], "score": 1.0}]}


@pytest.mark.parametrize(
    "change",
    [
        {"mask": [[]]},
        {"mask": {"mask_area": 0.5}},
        {"defense_s": None},
        {"model_s": "1"},
        {"score": []},
        {"sha256": {"a.png": 1}},
        {"sha256": {"../../plan.json": "00"}},
        {"facts": ABSURD},
    ],
)
def test_a_note_that_says_something_else_is_damage(
    tmp_path: Path, small: Small, install: Install, change: dict[str, Any]
) -> None:
    data = small("detect2d")
    install(model_spec(lambda _: Oracle([data]), "detect2d"))
    out = tmp_path / "out"
    evaluate(data, model="odd", out=out)
    whole = timeless(out)
    (note,) = out.glob("*/samples/000001.json")
    note.write_text(json.dumps(json.loads(note.read_text()) | change))
    again = evaluate(data, model="odd", out=out)
    assert again.rows[0].made == 1 and len(again.rows[0].damaged) == 1
    assert timeless(out) == whole


def test_an_evaluation_whose_plan_is_damaged_is_one_line(tmp_path: Path, small: Small, install: Install) -> None:
    data = small("depth")
    install(model_spec(lambda _: Oracle([data]), "depth"))
    evaluate(data, model="odd", out=tmp_path)
    plan = tmp_path / "plan.json"
    whole = json.loads(plan.read_text())
    for text, problem in (
        ("{", "plan.json: is not JSON .*; use another --out, or delete this folder$"),
        (json.dumps({key: whole[key] for key in whole if key != "defense"}), r"else \(its plan.json has other keys\)"),
    ):
        plan.write_text(text)
        with pytest.raises(DatasetError, match=problem):
            evaluate(data, model="odd", out=tmp_path)


@pytest.mark.parametrize("facts", [{}, None, [{"score": 1}]])
def test_facts_that_are_not_the_tasks_are_damage(tmp_path: Path, small: Small, install: Install, facts: Any) -> None:
    data = small("detect2d")
    install(model_spec(lambda _: Oracle([data]), "detect2d"))
    out = tmp_path / "out"
    evaluate(data, model="odd", out=out)
    whole = timeless(out)
    (note,) = out.glob("*/samples/000001.json")
    note.write_text(json.dumps(json.loads(note.read_text()) | {"facts": facts}))
    again = evaluate(data, model="odd", out=out)
    assert again.rows[0].made == 1 and "000001" in again.rows[0].damaged[0]
    assert timeless(out) == whole


def test_the_official_script_finds_the_predictions_and_agrees(
    tmp_path: Path, small: Small, install: Install, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = small("semseg")
    monkeypatch.setenv("CITYSCAPES_DATASET", str(data))
    tool = importlib.import_module("cityscapesscripts.evaluation.evalPixelLevelSemanticLabeling")
    helpers = importlib.import_module("cityscapesscripts.helpers.labels")
    install(tiny_segmenter)
    (row,) = evaluate(data, model="tiny_segmenter", out=tmp_path / "out").rows
    truths = sorted(str(path) for path in data.glob("gtFine/debug/*/*_gtFine_labelIds.png"))
    args = copy.copy(tool.args)
    args.evalLabels = [label.id for label in helpers.labels if label.id >= 0]
    args.JSONOutput, args.quiet, args.evalInstLevelScore = False, True, False
    args.predictionPath, args.predictionWalk = str(tmp_path / "out" / row.name / "predictions"), None
    with contextlib.redirect_stdout(io.StringIO()):
        found = [tool.getPrediction(args, truth) for truth in truths]
        scores = tool.evaluateImgLists(found, truths, args)
    assert row.metrics["task"]["miou"].value == pytest.approx(scores["averageScoreClasses"])
    assert 0 < row.metrics["task"]["category_miou"].value == pytest.approx(scores["averageScoreCategories"])


def test_batches_and_threads_change_nothing(tmp_path: Path, small: Small, install: Install) -> None:
    data = small("semseg", samples=5)
    install(tiny_segmenter)
    evaluate(data, model="tiny_segmenter", out=tmp_path / "one", workers=1)
    evaluate(data, model="tiny_segmenter", out=tmp_path / "two", workers=4, batch=3)
    one, two = timeless(tmp_path / "one"), timeless(tmp_path / "two")
    assert one == two
    assert len(one["model"]["weights_sha256"]) == 64
    metric = one["rows"][0]["metrics"]["task"]["pixel_accuracy"]
    assert 0 <= metric["low"] <= metric["value"] <= metric["high"] <= 1 and metric["low"] < metric["high"]
    assert [s["index"] for s in one["rows"][0]["per_sample"]] == [0, 1, 2, 3, 4]


class Finder:
    """A defense that knows random noise when it sees it, and says how it was called."""

    def __init__(self, roots: list[Path]) -> None:
        self.masks, self.fits = {}, []  # type: ignore[var-annotated]
        for root in roots:
            for sample in gear.open_dataset(root):
                self.masks[Oracle.key(sample.images)] = patch_masks(sample)["left"] & (root.name == "random")

    def fit(self, clean: Any, patched: Any, model: Any, rng: np.random.Generator) -> Any:
        self.fits.append((len(clean), len(patched), clean[0]["left"].shape, [set(v) for v in clean[:1]]))
        return {"learnt": True}

    def apply(self, views: Views, model: Any, state: Any, rng: np.random.Generator) -> DefenseResult:
        assert state == {"learnt": True} and model is not None
        mask = self.masks[Oracle.key(views)].astype(np.float32)
        return DefenseResult(views=views, mask={"left": mask}, score=float(mask.mean()))

    def wrap(self, model: Any) -> Any:
        return types.SimpleNamespace(predict=lambda views: model.predict(views), taps=model.taps)


def test_a_defense_is_fitted_wrapped_and_judged(tmp_path: Path, small: Small, install: Install) -> None:
    roots = [small("semseg", "none"), small("semseg", "random")]
    finder = Finder(roots)
    spec: DefenseSpec[Any] = DefenseSpec(
        name="finder", summary="Finds.", config=Config, build=lambda _: finder,  # type: ignore[arg-type]
        needs_calibration=True, needs_model=True, outputs=frozenset({"images", "mask", "score"}), taps=("stem",),
    )  # fmt: skip
    install(spec, tiny_segmenter, model_spec(lambda _: Oracle(roots), "semseg"))
    with pytest.raises(GearError, match=r"'finder' needs the feature maps stem; 'odd' has none"):
        evaluate(roots, model="odd", defense="finder", calibration=roots[0], out=tmp_path / "x")
    with pytest.raises(GearError, match="give --calibration DIR"):
        evaluate(roots, model="tiny_segmenter", defense="finder", out=tmp_path / "x")
    assert not (tmp_path / "x").exists()
    report = evaluate(
        roots, model="tiny_segmenter", defense="finder", calibration=roots[0], calibration_patched=roots[1],
        out=tmp_path / "out",
    )  # fmt: skip
    assert finder.fits == [(2, 2, (160, 320, 3), [{"left"}])]
    assert report.row("random").defense["mask_iou"] == 1 and "mask_iou" not in report.row("none").defense
    assert report.row("none").defense["mask_area"] == 0
    (difference,) = report.differences
    assert difference.auroc is not None and difference.auroc.value == 1
    assert report.row("none").cost["defense_s"] > 0
    text = (tmp_path / "out/table.txt").read_text()
    assert "guarded by finder" in text and "minus none" in text and "mask IoU" in text


def test_a_built_in_defense_by_the_command(
    tmp_path: Path, small: Small, install: Install, capsys: pytest.CaptureFixture[str]
) -> None:
    data = small("depth")
    install(tiny_depth)
    command = ["evaluate", "--model", "tiny_depth", "--data", str(data)]
    assert main([*command, "--out", str(tmp_path / "plain")]) == 0
    plain = capsys.readouterr().out
    assert plain.startswith("depth: tiny_depth\n") and "mae_m" in plain and "defense" not in plain
    guard = ["--defense", "jpeg", "--defense-set", "quality=5"]
    assert main([*command, *guard, "--out", str(tmp_path / "jpeg"), "--json"]) == 0
    said = capsys.readouterr().out
    assert said.endswith("}\n")
    facts = json.loads(said)
    assert facts["defense"]["options"]["quality"] == 5 and facts["model"]["name"] == "tiny_depth"
    plain_metric = timeless(tmp_path / "plain")["rows"][0]["metrics"]["task"]["mae_m"]["value"]
    assert facts["rows"][0]["metrics"]["task"]["mae_m"]["value"] != plain_metric
    assert facts == json.loads((tmp_path / "jpeg/results.json").read_text())


def test_bad_input_is_refused_before_anything_is_built(tmp_path: Path, small: Small, install: Install) -> None:
    data = small("semseg")

    def never(_: Any) -> Any:
        raise AssertionError("built")

    other: DefenseSpec[Any] = DefenseSpec(name="other", summary="O.", config=Config, build=never, tasks=("depth",))
    install(model_spec(never, "semseg", views=("right",)), tiny_depth, tiny_segmenter, other)
    cases: list[tuple[type[Exception], str, dict[str, Any]]] = [
        (UnknownNameError, "did you mean tiny_depth", {"model": "tiny_dept"}),
        (GearError, "'tiny_depth' does depth; .* is a semseg dataset", {"model": "tiny_depth"}),
        (GearError, "looks at right", {"model": "odd"}),
        (ConfigError, "did you mean 'width'", {"model_settings": ["widht=3"]}),
        (UnknownNameError, "did you mean reference", {"reports": ["referense"]}),
        (GearError, "'other' is for depth", {"defense": "other"}),
        (GearError, "quality=5 is a defense's option, but there is no defense", {"defense_settings": ["quality=5"]}),
        (GearError, "there is no defense: name one", {"calibration": data}),
        (GearError, "are the same data", {"data": [data, data]}),
        (GearError, "nothing to evaluate", {"data": []}),
        (GearError, "is a depth dataset, .* a semseg one", {"data": [data, small("depth")]}),
        (GearError, "at least 1", {"batch": 0}),
        (DatasetError, "no gear/<split>/plan.json", {"data": tmp_path / "nowhere"}),
        (DatasetError, "is a dataset", {"out": data}),
        (DatasetError, "no split 'val'", {"data": f"{data}:val"}),
    ]
    for kind, message, changes in cases:
        arguments = {"data": data, "model": "tiny_segmenter", "out": tmp_path / "x"} | changes
        with pytest.raises(kind, match=message):
            evaluate(arguments.pop("data"), **arguments)
    assert not (tmp_path / "x").exists()


@dataclass(frozen=True, kw_only=True)
class CameraConfig(Config):
    hfov_deg: float = 90.0
    baseline_m: float = 0.54


def test_a_model_for_another_camera_is_refused(tmp_path: Path, small: Small, install: Install) -> None:
    data = small("stereo3d")
    install(replace(model_spec(lambda _: Oracle([data]), "stereo3d"), config=CameraConfig))
    for name, value, taken in (("baseline_m", "0.3", "0.54"), ("hfov_deg", "60", "90")):
        message = f"collected with {name} {taken}, but model 'odd' assumes {value}; say --model-set {name}={taken}"
        with pytest.raises(GearError, match=message):
            evaluate(data, model="odd", model_settings=[f"{name}={value}"], out=tmp_path / "x")
    assert not (tmp_path / "x").exists()
    assert evaluate(data, model="odd", out=tmp_path / "x").rows[0].samples == 2


@dataclass(frozen=True, kw_only=True)
class ScaledConfig(Config):
    weights: str = "none"
    input_scale: float | None = None

    def __post_init__(self) -> None:
        if self.input_scale is not None and self.input_scale > 4:
            raise FieldError("input_scale", "is too large")


@pytest.mark.parametrize(
    ("said", "remedy"),
    [(0.25, "sees them at 80 px; it learnt from 512 px, .* smaller .* --model-set input_scale=1.6 corrects this"),
     (0.75, "collect larger ones")]
)  # fmt: skip
def test_pictures_of_another_size_than_the_weights_are_for_are_noted(
    tmp_path: Path, small: Small, install: Install, said: float, remedy: str
) -> None:
    data, weights = small("semseg"), tmp_path / "net.safetensors"
    write_weights(weights, {"bias": torch.zeros(1)}, {"options": json.dumps({"input_scale": said})})
    install(replace(model_spec(lambda _: Oracle([data]), "semseg"), config=ScaledConfig))

    def notes(out: str, *settings: str) -> list[str]:
        evaluate(data, model="odd", model_settings=settings, out=tmp_path / out)
        found: list[str] = json.loads((tmp_path / out / "results.json").read_text())["notes"]
        assert all(note in (tmp_path / out / "table.txt").read_text() for note in found)
        return found

    (note,) = notes("weights", f"weights={weights}")
    assert re.search(remedy, note) and str(data) in note
    # Weights that say nothing learnt from the task's pictures at the share that their network has by itself.
    write_weights(weights, {"bias": torch.zeros(1)}, {})
    install(replace(model_spec(lambda _: Oracle([data]), "semseg", input_scale=said), config=ScaledConfig))
    (note,) = notes("silent", f"weights={weights}")
    assert re.search(remedy, note)
    assert notes("none") == notes("given", f"weights={weights}", "input_scale=1") == []


def boom(views: Views) -> Any:
    raise RuntimeError("boom")


@pytest.mark.parametrize(
    ("predict", "message"),
    [
        (boom, r"odd \(odd_package \?\) failed at predict on sample 0: RuntimeError: boom"),
        (lambda views: sys.exit(3), "SystemExit: 3"),
        (lambda views: np.zeros((3, 3), np.uint8), r"prediction of sample \d: ValueError: prediction must have shape"),
        (lambda views: None, r"prediction of sample \d: AttributeError"),
        (lambda views: views["left"].__setitem__(0, 0), "ValueError: assignment destination is read-only"),
    ],
)
def test_a_bad_model_is_named(
    tmp_path: Path, small: Small, install: Install, predict: Callable[[Views], Any], message: str
) -> None:
    install(model_spec(lambda _: types.SimpleNamespace(predict=predict), "semseg"))
    for seed in (0, 1):  # the first try made nothing that the second could be mixed with
        with pytest.raises(PluginError, match=message):
            evaluate(small("semseg"), model="odd", out=tmp_path / "out", seed=seed)


def test_a_batch_of_too_few_answers_is_named(tmp_path: Path, small: Small, install: Install) -> None:
    install(model_spec(lambda _: types.SimpleNamespace(predict=boom, predict_many=lambda many: []), "semseg"))
    with pytest.raises(PluginError, match="gave 0 answers to 2 samples"):
        evaluate(small("semseg"), model="odd", out=tmp_path / "out", batch=2)
