"""`gear train --log-to`: what is logged, and that weights do not depend on it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gear.cli.main import main
from gear.formats.png import decode_rgb
from gear.measuring.sample_figures import CELL_WIDTH_PX
from gear.plugins.manager import catalogue
from gear.testing.tiny_networks import tiny_segmenter
from gear.verbs.train import loop
from gear.verbs.train.checkpoint import TrainingState
from gear.verbs.train.run import TrainReport, train
from gear.verbs.train.run_log import FIGURE, metric_title
from tests.plugins.loggers.reading import read_log

pytest.importorskip("tensorboard")
Street = Callable[..., Path]
LOSS, MIOU = "validation/loss (down is better)", "validation/miou (up is better)"
TRAINING_LOSS = "training/loss (down is better)"


def quick(street: Street, out: Path, **changes: Any) -> TrainReport:
    arguments: dict[str, Any] = {"epochs": 6, "batch": 2, "workers": 1, "out": out, "log_to": "tensorboard"}
    return train("semseg", "tiny_segmenter", street("semseg"), **(arguments | changes))


@pytest.fixture
def two_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(loop, "NOTE_EVERY", 2)


def test_a_training_is_logged_and_its_weights_are_the_same(
    street: Street, tmp_path: Path, install: Any, two_steps: None
) -> None:
    plain = quick(street, tmp_path / "plain", log_to=None)
    report = quick(street, tmp_path / "out")
    assert report.weights.read_bytes() == plain.weights.read_bytes()
    assert report.metrics == plain.metrics
    figure = (tmp_path / "plain/samples.jpg").read_bytes()
    assert figure == (tmp_path / "out/samples.jpg").read_bytes()
    assert "![validation samples](samples.jpg)" in (tmp_path / "plain/card.md").read_text()
    cells = 3  # picture, prediction and ground truth of the held-out sample
    height, width = decode_rgb(figure).shape[:2]
    assert width == cells * CELL_WIDTH_PX and height > CELL_WIDTH_PX // 2
    found = read_log(tmp_path / "out/log")
    assert [step for step, _ in found.scalars[LOSS]] == [2, 4, 6, 8, 10, 12] == [s for s, _ in found.scalars[MIOU]]
    assert [step for step, _ in found.scalars[TRAINING_LOSS]] == [2, 4, 6, 8, 10, 12]
    assert dict(found.scalars[MIOU])[report.best_step] == pytest.approx(report.metrics["miou"], rel=1e-4)
    assert len(found.scalars["training/learning rate"]) == 6
    undirected = {name for name in found.scalars if not name.endswith(" is better)")}
    assert undirected == {"training/learning rate"} and len(found.scalars) > 50
    assert [step for step, _ in found.pictures[FIGURE]] == [2, 4, 6, 8, 10, 12]
    assert '"learning_rate"' in found.texts["config"] and "tiny_segmenter on semseg" in found.texts["config"]


@pytest.mark.parametrize("stop_at", [3, 6])
def test_a_resumed_training_continues_its_log(
    street: Street, tmp_path: Path, install: Any, two_steps: None, monkeypatch: pytest.MonkeyPatch, stop_at: int
) -> None:
    monkeypatch.setattr(loop, "CHECKPOINT_EVERY_S", 0.0 if stop_at == 3 else 1e9)

    def stop(progress: TrainingState, share: float, metrics: Any) -> None:
        if progress.step == stop_at:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        quick(street, tmp_path, on_step=stop)
    quick(street, tmp_path)
    found = read_log(tmp_path / "log")
    for name in (LOSS, MIOU, TRAINING_LOSS, "training/learning rate"):
        assert [step for step, _ in found.scalars[name]] == [2, 4, 6, 8, 10, 12], name
    assert [step for step, _ in found.pictures[FIGURE]] == [2, 4, 6, 8, 10, 12]


def test_a_task_that_cannot_draw_loses_no_weights(
    street: Street, tmp_path: Path, install: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*given: Any) -> Any:
        raise RuntimeError("no colours")

    monkeypatch.setattr("gear.measuring.sample_figures.check_previews", broken)
    warnings: list[str] = []
    report = quick(street, tmp_path, epochs=2, on_warning=warnings.append)
    assert report.weights.is_file()
    assert any("no samples.jpg (RuntimeError: no colours)" in line for line in warnings)
    assert not (tmp_path / "samples.jpg").exists() and "samples.jpg" not in (tmp_path / "card.md").read_text()
    (warning,) = [line for line in warnings if "no figures" in line]
    assert "RuntimeError: no colours" in warning
    found = read_log(tmp_path / "log")
    assert len(found.scalars[LOSS]) == 2 and not found.pictures


def test_metrics_state_a_direction_that_is_known() -> None:
    spec: Any = catalogue().get("task", "depth").spec
    task = spec.build(spec.config())
    assert metric_title("loss", spec, task) == "loss (down is better)"
    assert metric_title("eigen_d1", spec, task) == "eigen_d1 (up is better)"
    assert metric_title("rmse_m", spec, task) == "rmse_m (down is better)"
    assert metric_title("reference.d1", spec, task) == "reference.d1 (up is better)"
    assert metric_title("nearest_obstacle.bias_rel", spec, task) == "nearest_obstacle.bias_rel"


def test_the_command_logs(street: Street, tmp_path: Path, install: Any) -> None:
    install(tiny_segmenter)
    words = ["--task", "semseg", "--model", "tiny_segmenter", "--data", str(street("semseg")), "--epochs", "1"]
    assert main(["train", *words, "--out", str(tmp_path), "--log-to", "tensorboard", "--log-set", "flush_s=0"]) == 0
    assert LOSS in read_log(tmp_path / "log").scalars
