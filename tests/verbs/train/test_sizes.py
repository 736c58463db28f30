"""How large pictures and crops are that a training shows."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest
from safetensors import safe_open

from gear.plugins.build import find
from gear.readers import Samples, all_of, open_all
from gear.testing.tiny_networks import TinyConfig, TinySegmenter, tiny_segmenter
from gear.values.errors import ConfigError, GearError
from gear.verbs.train import sizes, starting
from gear.verbs.train.config import TrainConfig, read_config
from gear.verbs.train.run import train

Street = Callable[..., Path]
WIDTH, HEIGHT = 128, 64


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaledConfig(TinyConfig):
    """Runs at a share of its pictures' size."""

    input_scale: float | None = None


class Curious(TinySegmenter):
    """Remembers how large the pictures are that it sees."""

    shown: ClassVar[set[tuple[int, int]]] = set()

    def forward(self, views: Any, samples: Any = None) -> Any:
        self.shown.add(tuple(views["left"].shape[-2:]))
        return super().forward(views, samples)

    def predict(self, views: Any) -> Any:
        self.shown.add(views["left"].shape[:2])
        return super().predict(views)


@pytest.fixture
def scaled(install: Callable[..., None]) -> None:
    Curious.shown = set()
    install(replace(tiny_segmenter, config=ScaledConfig, build=Curious))


def config_of(*settings: str, **flags: Any) -> TrainConfig:
    return read_config(tiny_segmenter.recipe, flags, settings)  # type: ignore[arg-type]


def samples_of(street: Street, task: str = "semseg") -> Samples:
    return all_of(open_all([street(task)], task, names=("train",)))


def test_a_short_training_on_a_cpu_shows_as_many_pixels_as_it_has_time_for(
    street: Street, scaled: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sizes, "LEAST_PIXELS", 16)
    monkeypatch.setattr(sizes, "PIXELS_A_SECOND", WIDTH * HEIGHT / 400)
    found, samples = find("model", "tiny_segmenter"), samples_of(street)

    def scale(*settings: str, **flags: Any) -> float:
        return sizes.picture_scale(found, config_of(*settings, **flags), samples)

    assert scale(time_budget_s=100) == 0.5
    assert scale(time_budget_s=25) == 0.25
    assert scale(time_budget_s=400) == scale(time_budget_s=350) == 1
    assert scale("picture_scale=0.75", time_budget_s=100) == 0.75
    assert scale(epochs=3) == 1
    assert scale("crop_px=[32, 32]", time_budget_s=100) == 1
    assert scale("options.input_scale=0.5", time_budget_s=100) == 1
    assert scale("adversarial.attack=eot", time_budget_s=100) == 1
    with pytest.raises(GearError, match="patches are put into whole pictures"):
        scale("adversarial.attack=eot", "picture_scale=0.5")


def test_a_network_that_could_not_say_it_afterwards_sees_them_whole(
    street: Street, install: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sizes, "LEAST_PIXELS", 16)
    install(tiny_segmenter)
    assert sizes.picture_scale(find("model", "tiny_segmenter"), config_of(time_budget_s=1), samples_of(street)) == 1


@pytest.mark.parametrize("quick", [True, False])
def test_half_precision_is_for_time_budgets_on_devices_that_are_quicker_so(
    quick: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(starting, "supports_bfloat16", lambda device: quick)
    found = find("model", "ddrnet23_slim")
    half = "bfloat16" if quick else "float32"
    assert starting.precision_of(found, config_of(time_budget_s=60)) == half
    assert starting.precision_of(found, config_of()) == "float32"
    for asked in ("float32", "bfloat16"):
        assert starting.precision_of(found, config_of(f"precision={asked}", time_budget_s=60)) == asked
    own = SimpleNamespace(spec=replace(found.spec, config=TinyConfig))
    assert starting.precision_of(own, config_of(time_budget_s=60)) == "float32", "a network that does not know of it"


def test_validation_and_weights_know_of_smaller_pictures(street: Street, scaled: None, tmp_path: Path) -> None:
    said: list[str] = []
    arguments: dict[str, Any] = {"epochs": 1, "batch": 2, "workers": 1, "on_warning": said.append}
    report = train(
        "semseg", "tiny_segmenter", street("semseg"), out=tmp_path, settings=["picture_scale=0.5"], **arguments
    )
    assert Curious.shown == {(HEIGHT // 2, WIDTH // 2)}
    with safe_open(str(report.weights), framework="pt") as opened:
        assert json.loads(opened.metadata()["options"]) == {"input_scale": 0.5 * WIDTH / 2048}
    assert json.loads((tmp_path / "train.json").read_text())["config"]["picture_scale"] == 0.5
    assert len(said) == 1 and "0.5 of their size; --set picture_scale=1" in said[0]


def test_pictures_of_several_sizes_are_an_error(scaled: None) -> None:
    """Weights of one size say at which share they are to be used; of several, there is no such share."""

    def note(name: str, *widths: int, settings: tuple[str, ...] = ()) -> str:
        records = [SimpleNamespace(cameras=[SimpleNamespace(width_px=width)]) for width in widths]
        datasets = [SimpleNamespace(sidecar=lambda _, r=record: SimpleNamespace(record=r)) for record in records]
        samples: Any = SimpleNamespace(datasets=datasets)
        return starting.sizes_note(find("model", name), config_of(*settings), samples)

    told = note("tiny_segmenter", 1024, 512, 512)
    assert told.startswith("pictures are 512, 1024 px wide") and "--set options.input_scale=SHARE" in told
    assert not note("tiny_segmenter", 512, 512)
    assert not note("tiny_segmenter", 1024, 512, settings=("options.input_scale=0.5",))


def test_crops_are_never_larger_than_what_is_shown(street: Street) -> None:
    samples = samples_of(street)

    def crop(text: str, scales: str = "[1, 1]", scale: float = 1.0) -> tuple[int, int] | None:
        config = config_of(f"crop_px={text}", f"scales={scales}")
        return sizes.without_empty_margins(config, replace(samples, scale=scale)).crop_px

    assert crop("[384, 640]") == (HEIGHT, WIDTH)
    assert crop("[32, 640]") == (32, WIDTH)
    assert crop("[384, 100]", "[0.5, 1.25]") == (80, 100)
    assert crop("[384, 100]", "[0.5, 1.25]", 0.5) == (40, 80)
    assert crop("[384, 100]", "[0.1, 0.1]") == (16, 16)
    assert crop("[384, 640]", scale=0.2) == (16, 26)
    assert crop("null") is None


@pytest.mark.parametrize("scale", ["0", "1.5", "-1"])
def test_a_share_that_is_none_is_refused(scale: str) -> None:
    with pytest.raises(ConfigError, match=r"picture_scale: is a share, above 0 and at most 1"):
        config_of(f"picture_scale={scale}")
