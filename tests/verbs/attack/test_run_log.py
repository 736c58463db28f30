"""`gear attack --log-to`: what is logged, that results do not depend on it, and what happens when the logger fails."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from gear.cli.main import main
from gear.contracts.loggers import LoggedRun
from gear.contracts.specs import LoggerSpec
from gear.measuring import run_log
from gear.measuring.sample_figures import CELL_WIDTH_PX
from gear.reporting.picture_grid import CAPTION_PX
from gear.testing.tiny_networks import tiny_segmenter
from gear.values.errors import GearError, UnknownNameError
from gear.verbs.attack import monitor
from gear.verbs.attack.curve_titles import curve_title
from gear.verbs.attack.run import attack
from gear.verbs.attack.run_log import FIGURE
from tests.plugins.loggers.reading import read_log
from tests.verbs.attack.conftest import SMALL, wrapping
from tests.verbs.conftest import Install, Nothing, Small

pytest.importorskip("tensorboard")
HELD_OUT = "validation/objective on validation samples (up is better for the attack)"


class Failing:
    """A logger that fails at one of its methods; `entries` counts the calls before."""

    def __init__(self, at: str, error: BaseException) -> None:
        self.at, self.error = at, error
        self.calls: list[str] = []

    def open(self, run: LoggedRun) -> Failing:
        self._called("open")
        return self

    def scalar(self, *entry: Any) -> None:
        self._called("scalar")

    def picture(self, *entry: Any) -> None:
        self._called("picture")

    def text(self, *entry: Any) -> None:
        self._called("text")

    def flush(self) -> None:
        self._called("flush")

    def close(self) -> None:
        self._called("close")

    def _called(self, name: str) -> None:
        self.calls.append(name)
        torch.rand(1)
        if name == self.at:
            raise self.error


def failing(at: str, error: BaseException) -> tuple[LoggerSpec[Any], Failing]:
    made = Failing(at, error)
    return LoggerSpec(name="failing", summary="Fails.", config=Nothing, build=lambda config: made), made


@pytest.fixture(scope="module")
def plain(small: Small, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The patch folder of an attack without a log."""
    from tests.verbs.conftest import put_package

    with pytest.MonkeyPatch.context() as patched:
        put_package(patched, (tiny_segmenter,))
        out = tmp_path_factory.mktemp("plain") / "patches"
        attack(small(), model="tiny_segmenter", out=out, steps=4, every=2, val=small(split="val"), settings=SMALL)
        yield out


def logged(small: Small, out: Path, **changes: Any) -> Any:
    arguments: dict[str, Any] = {"steps": 4, "every": 2, "val": small(split="val"), "log_to": "tensorboard"}
    return attack(small(), model="tiny_segmenter", out=out, settings=SMALL, **(arguments | changes))


def same_patches(one: Path, other: Path) -> bool:
    names = ("patch_0.png", "patch.safetensors", "figures/samples.png")
    return all((one / name).read_bytes() == (other / name).read_bytes() for name in names)


def test_an_attack_is_logged_and_its_patches_are_the_same(
    small: Small, install: Install, plain: Path, tmp_path: Path
) -> None:
    report = logged(small, tmp_path / "out")
    assert same_patches(plain, tmp_path / "out")
    found = read_log(tmp_path / "out/log")
    assert [step for step, _ in found.scalars[HELD_OUT]] == [2, 4]
    assert [value for _, value in found.scalars[HELD_OUT]] == pytest.approx(
        [value for _, value in report.facts["validation_harm"]], rel=1e-4
    )
    for name, curve in report.facts["curves"].items():
        points = found.scalars[f"training/{curve_title(name)}"]
        assert [step for step, _ in points] == [1, 2, 3, 4]
        assert [value for _, value in points] == pytest.approx(curve, rel=1e-4, abs=1e-6)
    assert [step for step, _ in found.pictures["patches/patch_0"]] == [1, 2, 4, 4]
    assert np.array_equal(found.pictures["patches/patch_0"][-1][1], picture_of(tmp_path / "out/patch_0.png"))
    figures = [rgb for _, rgb in found.pictures[FIGURE]]
    assert not np.array_equal(figures[0], figures[-1])
    assert '"steps": 4' in found.texts["config"] and "scene_specific on tiny_segmenter" in found.texts["config"]
    result = "result/objective, training samples, patch (up is better for the attack)"
    assert found.scalars[result] == [(4, pytest.approx(report.facts["achieved"]["training"]["patch"], rel=1e-4))]


def picture_of(path: Path) -> Any:
    import cv2

    return cv2.imread(str(path))[..., ::-1]


@pytest.mark.parametrize("stop_at", [2, 3])
def test_a_resumed_attack_continues_its_log(
    small: Small, install: Install, plain: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stop_at: int
) -> None:
    """Steps after the checkpoint were logged before the power cut, and are logged once more."""
    saved = monitor.Recorder.save
    monkeypatch.setattr(monitor, "SECONDS_BETWEEN", 0.0)

    def save(self: Any, done: int, state: Any) -> None:
        if done < stop_at:
            saved(self, done, state)

    def stop(done: int, total: int) -> None:
        if done == stop_at + 1:
            raise KeyboardInterrupt

    with monkeypatch.context() as cut:
        cut.setattr(monitor.Recorder, "save", save)
        with pytest.raises(KeyboardInterrupt):
            logged(small, tmp_path / "out", on_progress=stop)
    logged(small, tmp_path / "out")
    assert same_patches(plain, tmp_path / "out")
    found = read_log(tmp_path / "out/log")
    assert [step for step, _ in found.scalars[HELD_OUT]] == [2, 4]
    for name, points in found.scalars.items():
        if name.startswith("training/"):
            assert [step for step, _ in points] == [1, 2, 3, 4], name
    assert [step for step, _ in found.pictures["patches/patch_0"]] == [1, 2, 4, 4]


@pytest.mark.parametrize(
    ("at", "error"),
    [(at, OSError(28, "No space left on device")) for at in ("open", "scalar", "picture", "text", "flush", "close")]
    + [("scalar", SystemExit(3))],
)
def test_a_logger_that_fails_loses_no_patch(
    small: Small, install: Install, plain: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at: str,
    error: BaseException,
) -> None:  # fmt: skip
    monkeypatch.setattr(monitor, "SECONDS_BETWEEN", 0.0)
    spec, made = failing(at, error)
    install(tiny_segmenter, spec)
    warnings: list[str] = []
    logged(small, tmp_path / "out", log_to="failing", on_warning=warnings.append)
    assert same_patches(plain, tmp_path / "out")
    (warning,) = [line for line in warnings if "log" in line]
    assert "the log ends here" in warning and type(error).__name__ in warning
    assert made.calls.count(at) == 1 and made.calls[-1] in (at, "close")


def test_a_disk_that_is_nearly_full_is_left_to_the_results(
    small: Small, install: Install, plain: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_log, "free_bytes", lambda folder: 1_000_000)
    warnings: list[str] = []
    logged(small, tmp_path / "out", on_warning=warnings.append)
    assert same_patches(plain, tmp_path / "out")
    assert any("less than 200 MB are free there" in line for line in warnings)
    assert not read_log(tmp_path / "out/log").pictures


def test_a_link_in_place_of_the_log_is_not_followed(small: Small, install: Install, tmp_path: Path) -> None:
    (tmp_path / "victim").mkdir()
    (tmp_path / "victim/events.out.tfevents.0000000001.gear").write_text("mine")
    (tmp_path / "out").mkdir()
    (tmp_path / "out/log").symlink_to(tmp_path / "victim")
    with pytest.raises(GearError, match="log: is a link"):
        logged(small, tmp_path / "out")
    assert [path.read_text() for path in (tmp_path / "victim").iterdir()] == ["mine"]


def test_several_models_are_drawn_each(small: Small, install: Install, tmp_path: Path) -> None:
    data, models = small(), ["tiny_segmenter", "other_segmenter"]
    attack(data, model=models, out=tmp_path, steps=1, settings=SMALL, log_to="tensorboard")
    drawn = read_log(tmp_path / "log").pictures[FIGURE][0][1]
    assert drawn.shape[1] == 4 * CELL_WIDTH_PX  # a picture, two predictions, the ground truth


def test_what_is_refused_is_one_line_and_comes_first(
    small: Small, install: Install, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(UnknownNameError, match="no logger named 'tensorbord'; did you mean tensorboard"):
        attack("nowhere", model="tiny_segmenter", out=tmp_path / "out", log_to="tensorbord")
    with pytest.raises(GearError, match="--log-set has options of a logger, and none is named; add --log-to NAME"):
        attack("nowhere", model="tiny_segmenter", out=tmp_path / "out", log_settings=["flush_s=1"])
    monkeypatch.setattr("gear.plugins.loggers.tensorboard.find_spec", lambda name: None)
    words = ["attack", "--model", "tiny_segmenter", "--data", "nowhere", "--out", str(tmp_path / "out")]
    assert main([*words, "--log-to", "tensorboard"]) == 2
    assert "tensorboard is not installed; pip install 'mujoco-gear[tensorboard]'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_finished_patches_are_not_logged_again(small: Small, install: Install, tmp_path: Path) -> None:
    logged(small, tmp_path / "out", val=())
    before = {path: path.read_bytes() for path in (tmp_path / "out/log").iterdir()}
    warnings: list[str] = []
    logged(small, tmp_path / "out", val=(), on_warning=warnings.append)
    assert any("there already, so that nothing is logged" in line for line in warnings)
    assert {path: path.read_bytes() for path in (tmp_path / "out/log").iterdir()} == before
    logged(small, tmp_path / "out", val=(), force=True, steps=1)
    found = read_log(tmp_path / "out/log")
    assert {step for name in found.scalars for step, _ in found.scalars[name]} == {1}


def test_predictions_in_figures_are_those_behind_the_defense(small: Small, install: Install, tmp_path: Path) -> None:
    install(tiny_segmenter, wrapping)
    clean = []
    for defense in (None, "wrapping"):
        warnings: list[str] = []
        out = tmp_path / str(defense)
        logged(small, out, steps=1, val=(), defense=defense, on_warning=warnings.append)
        assert not warnings
        line = picture_of(out / "figures/samples.png")[: 240 + CAPTION_PX]
        clean.append((line[:, :CELL_WIDTH_PX], line[:, CELL_WIDTH_PX : 2 * CELL_WIDTH_PX]))
    (picture, prediction), (same_picture, defended) = clean
    assert np.array_equal(picture, same_picture) and not np.array_equal(prediction, defended)
