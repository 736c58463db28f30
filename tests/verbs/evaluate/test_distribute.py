"""Evaluations of several datasets over the workers of an engine: the results of one process."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gear.cli.machine_limits import OPEN_FILES
from gear.cli.main import main
from gear.contracts.defenses import DefenseResult
from gear.contracts.executors import Outcome
from gear.contracts.specs import DefenseSpec
from gear.dataset.executors.in_process import InThisProcess
from gear.testing.tiny_networks import tiny_segmenter
from gear.values.errors import GearError
from gear.verbs.evaluate import distribute
from gear.verbs.evaluate.request import EvaluateRequest
from gear.verbs.evaluate.run import evaluate
from tests.shared import few_files
from tests.verbs.conftest import Nothing, Small, put_package
from tests.verbs.evaluate.test_evaluate import timeless


@pytest.fixture
def data(small: Small, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    put_package(monkeypatch, [tiny_segmenter])
    return [small("semseg", "none"), small("semseg", "random")]


@pytest.fixture
def engines(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The engines that were opened; their work is done in this process, where the tiny network is a plugin."""
    asked: list[Any] = []

    def opened(name: str, **given: Any) -> InThisProcess:
        asked.append((name, given["workers"]))
        return InThisProcess()

    monkeypatch.setattr(distribute, "open_engine", opened)
    return asked


class Learner:
    """A defense that looks at all calibration pictures and changes nothing."""

    def fit(self, clean: Any, patched: Any, model: Any, rng: np.random.Generator) -> int:
        return sum(len(views) for views in clean)

    def apply(self, views: Any, model: Any, state: int, rng: np.random.Generator) -> DefenseResult:
        return DefenseResult(views=views)

    def wrap(self, model: Any) -> Any:
        return model


def test_a_calibration_in_a_worker_is_shown(
    tmp_path: Path, data: list[Path], engines: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    spec: DefenseSpec[Any] = DefenseSpec(
        name="learner", summary="Learns.", config=Nothing, build=lambda _: Learner(),  # type: ignore[arg-type, return-value]
        needs_calibration=True, needs_model=True, outputs=frozenset({"images"}),
    )  # fmt: skip
    put_package(monkeypatch, [spec, tiny_segmenter])
    seen: list[tuple[int, int]] = []
    evaluate(
        data[:1],
        out=tmp_path,
        model="tiny_segmenter",
        defense="learner",
        calibration=data[0],
        engine="ray",
        on_fit_progress=lambda done, total: seen.append((done, total)),
    )
    assert engines and seen[-1] == (2, 2)


@pytest.mark.parametrize("defense", [None, "gaussian"])
def test_the_results_are_those_of_one_process(
    defense: str | None, tmp_path: Path, data: list[Path], engines: list[Any]
) -> None:
    given: dict[str, Any] = {"model": "tiny_segmenter", "defense": defense}
    evaluate(data, out=tmp_path / "one", **given)
    assert not engines
    seen: list[tuple[int, int]] = []
    report = evaluate(
        data,
        out=tmp_path / "many",
        engine_workers=2,
        on_progress=lambda done, total: seen.append((done, total)),
        **given,
    )
    assert engines == [("processes", 2)]
    assert [row.made for row in report.rows] == [2, 2] and seen[:3] == [(0, 2), (1, 2), (2, 2)]
    assert timeless(tmp_path / "many") == timeless(tmp_path / "one")
    one, many = (
        {path.relative_to(root): path.read_bytes() for path in root.rglob("predictions/**/*") if path.is_file()}
        for root in (tmp_path / "one", tmp_path / "many")
    )
    assert one == many and one
    again = evaluate(data, out=tmp_path / "many", engine_workers=2, **given)
    assert [row.made for row in again.rows] == [0, 0]


def test_a_damaged_prediction_is_named(tmp_path: Path, data: list[Path], engines: list[Any]) -> None:
    evaluate(data, out=tmp_path / "out", model="tiny_segmenter")
    next((tmp_path / "out").rglob("predictions/**/*.png")).write_bytes(b"damaged")
    notes: list[str] = []
    report = evaluate(data, out=tmp_path / "out", model="tiny_segmenter", engine="ray", on_warning=notes.append)
    assert sorted(row.made for row in report.rows) == [0, 1]
    assert sum(note.endswith("; the sample was predicted again") for note in notes) == 1


def test_a_dataset_that_fails_is_named_and_the_others_are_predicted(
    tmp_path: Path, data: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Losing(InThisProcess):
        def run(self, work: Any, indices: Any, report: Any) -> None:
            for index in indices:
                if index == 0:
                    report(Outcome(index=0, kind="failed", error="a worker was lost"))
                else:
                    super().run(work, [index], report)

    monkeypatch.setattr(distribute, "open_engine", lambda *names, **given: Losing())
    with pytest.raises(GearError) as caught:
        evaluate(data, out=tmp_path / "out", model="tiny_segmenter", engine_workers=2)
    assert str(caught.value) == f"{data[0]}: a worker was lost; the errors are noted in {tmp_path}/out/failures"
    assert json.loads((tmp_path / "out/failures/0.json").read_text())["tries"] == 3
    assert len(list((tmp_path / "out").rglob("samples/*.json"))) == 2
    assert not (tmp_path / "out/results.json").exists()
    assert json.loads((tmp_path / "out/plan.json").read_text())


def test_several_workers_or_an_engine_distribute_the_datasets() -> None:
    given: dict[str, Any] = {"data": ("a",), "model": "tiny"}
    assert not EvaluateRequest(**given).is_distributed
    assert EvaluateRequest(**given, engine_workers=2).is_distributed
    assert EvaluateRequest(**given, engine="slurm").is_distributed
    with pytest.raises(GearError, match="engine_workers must be at least 1"):
        EvaluateRequest(**given, engine_workers=0)


@pytest.mark.parametrize("further", [0, 3])
@pytest.mark.parametrize("engine", [(), ("--engine", "ray")])
def test_few_file_descriptors_are_one_line(
    further: int,
    engine: tuple[str, ...],
    tmp_path: Path,
    data: list[Path],
    engines: list[Any],
    capsys: pytest.CaptureFixture[str],
) -> None:
    command = ["evaluate", "--model", "tiny_segmenter", "--data", str(data[0]), "--out", str(tmp_path / "out"), *engine]
    with few_files(further):
        code = main(command)
    assert (code, capsys.readouterr().err) == (2, f"gear: {OPEN_FILES}\n")
    assert main(command) == 0, "the same command goes on"
