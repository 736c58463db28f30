from __future__ import annotations

import os
from pathlib import Path

import pytest

from gear.config.collection import CollectionConfig, SplitConfig
from gear.config.load import find_config, load_collection, load_simulation, split_of
from gear.values.errors import ConfigError, UnknownNameError


def test_the_task_alone_is_enough() -> None:
    config = load_collection(None, {"task": "stereo3d"})
    assert config == CollectionConfig(task="stereo3d", options=config.options)
    assert (config.town, config.scene, config.split, config.patch) == ("town10", "billboard01", "test", "none")
    assert (config.weather.preset, config.renderer, config.quality) == ("ClearNoon", "raster", "film")


def test_flags_go_before_the_file_and_settings_before_flags(tmp_path: Path) -> None:
    file = tmp_path / "c.yml"
    file.write_text("task: semseg\nscene: billboard02\nsplit: val\nweather: {preset: CloudyNoon, cloudiness: 30}\n")
    config = load_collection(str(file), {"scene": "billboard03", "split": None}, ["weather.cloudiness=40"])
    assert (config.scene, config.split, config.weather.preset, config.weather.cloudiness) == (
        "billboard03",
        "val",
        "CloudyNoon",
        40.0,
    )


def test_a_setting_below_a_bare_word_keeps_the_word(tmp_path: Path) -> None:
    config = load_collection(None, {"task": "semseg", "weather": "HardRainNoon"}, ["weather.sun_altitude_deg=-20"])
    assert (config.weather.preset, config.weather.sun_altitude_deg) == ("HardRainNoon", -20.0)
    file = tmp_path / "c.yml"
    file.write_text("task: semseg\nweather: WetNoon\n")
    assert load_collection(str(file), {}, ["weather.cloudiness=40"]).weather.preset == "WetNoon"
    assert load_collection(str(file), {}, ["weather.preset=CloudyNoon"]).weather.preset == "CloudyNoon"


def test_a_file_without_keys_is_refused_whatever_the_flags(tmp_path: Path) -> None:
    file = tmp_path / "c.yml"
    for text in ("[task, semseg]", "semseg"):
        file.write_text(text)
        with pytest.raises(ConfigError, match=r"c.yml:1:1: expected keys and values"):
            load_collection(str(file), {"task": "semseg"})


def test_a_setting_below_the_word_of_another_setting_keeps_the_word() -> None:
    weather = load_collection(None, {"task": "semseg"}, ["weather=WetNight", "weather.fog_density=10"]).weather
    assert (weather.preset, weather.fog_density) == ("WetNight", 10.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("task: semseg\nscen: a\n", r"c.yml:2:1: scen: unknown key \(did you mean 'scene'\?\)"),
        ("task: semseg\nweather: {cloudiness: 140}\n", r"c.yml:2:23: weather.cloudiness: is a percentage, 0 to 100"),
        ("task: semseg\nsplit: Test Split\n", r"c.yml:2:8: split: 'Test Split' is not a split's name"),
        ("task: semseg\nmix:\n  bus: 3\n  tram: 2\n", r"c.yml:4:9: mix.tram: is no kind of vehicle; there are car"),
        ("task: semseg\nmix: {bus: much}\n", r"c.yml:2:12: mix.bus: expected float, got 'much'"),
        ("task: semseg\nsamples: 0\n", r"c.yml:2:10: samples: must be 1 to 1000000, got 0"),
        ("task: semseg\nrenderer: filment\n", r"filament, classic, got 'filment'; did you mean filament\?"),
        ("scene: a\n", r"c.yml:1:1: task: missing"),
    ],
)  # fmt: skip
def test_mistakes_say_where(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "c.yml").write_text(text)
    with pytest.raises(ConfigError, match=message):
        load_collection(str(tmp_path / "c.yml"), {})


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("fog_falloff", "1e40", r"must be 0 to 1000000, got 1e\+40"),
        ("mie_scattering_scale", "-1", "must be 0 to 1000000, got -1"),
        ("sun_azimuth_deg", "361", "must be -360 to 360 degrees, got 361"),
        ("sun_altitude_deg", "-91", "must be -90 to 90 degrees, got -91"),
        ("fog_distance_m", "inf", "expected float, got 'inf'"),
    ],
)
def test_weathers_that_no_picture_can_show_are_refused(tmp_path: Path, key: str, value: str, message: str) -> None:
    (tmp_path / "c.yml").write_text(f"task: semseg\nweather:\n  {key}: {value}\n")
    with pytest.raises(ConfigError, match=rf"c.yml:3:{len(key) + 5}: weather\.{key}: {message}"):
        load_collection(str(tmp_path / "c.yml"), {})


def test_the_papers_splits() -> None:
    simulation = load_simulation("default")
    counts = {name: (s.seed, s.samples, s.frames) for name, s in simulation.splits.items()}
    assert counts == {
        "train": (123, 100, 1), "val": (131, 50, 1), "test": (363, 50, 1), "debug": (10, 2, 1),
        "finetuning": (0, 300, 1), "video": (60, 1, 105),
    }  # fmt: skip
    assert split_of(simulation, "test_night") == SplitConfig(seed=363, samples=50)
    with pytest.raises(UnknownNameError, match="no split named 'tst'; did you mean test"):
        split_of(simulation, "tst")


def test_a_carla_gear_config_is_accepted_as_it_is(tmp_path: Path) -> None:
    file = tmp_path / "collection_config.yml"
    file.write_text(
        "basepath: /data/sets\nroot: three\n\ntown_name: Town10HD\nweather: # fixed\ntask: 3dod # one of four\n"
        "split: train\nbillboard: billboard05\npatch_folder:\npatch_type:\nnet: # unused\ndebug: False\n"
    )
    config = load_collection(str(file), {})
    assert (config.task, config.town, config.scene, config.split) == ("stereo3d", "town10", "billboard05", "train")
    assert (config.patch, config.weather.preset) == ("none", "ClearNoon")
    assert Path(config.root) == Path("/data/sets/three/billboard05")
    assert load_collection(str(file), {"scene": "truck"}).scene == "truck"


def test_a_carla_gear_configs_folder_is_that_of_the_scene_in_effect(tmp_path: Path) -> None:
    file = tmp_path / "c.yml"
    file.write_text("basepath: /data\ntask: ss\nbillboard: billboard02\n")

    def root(flags: dict[str, str | None], *settings: str) -> Path:
        return Path(load_collection(str(file), flags, settings).root)

    assert root({}) == Path("/data/ss/billboard02")
    assert root({"scene": "billboard05"}) == root({}, "scene=billboard05") == Path("/data/ss/billboard05")
    assert root({"scene": "/somewhere/my.yml:corner"}) == Path("/data/ss/corner")
    assert root({"task": "depth"}) == Path("/data/depth/billboard02")
    assert root({"scene": "billboard05", "root": "mine"}) == root({"scene": "a"}, "root=mine") == Path("mine")
    file.write_text("basepath: /data\nroot: three\ntask: ss\n")
    assert root({}) == Path("/data/three")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("basepath: a\nroot: b\ntask: 4dod\n", r":3:7: task: expected one of ss, 2dod, 3dod, depth, got '4dod'"),
        ("basepath: a\nroot: b\n", r"task: missing"),
        ("basepath: a\ntask: ss\nbilboard: x\n", r":3:1: bilboard: unknown key in a CARLA-GeAR config"),
    ],
)
def test_mistakes_in_a_carla_gear_config_say_where(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "c.yml").write_text(text)
    with pytest.raises(ConfigError, match=message):
        load_collection(str(tmp_path / "c.yml"), {})


def test_a_seed_without_a_number_of_samples_is_an_error(tmp_path: Path) -> None:
    file = tmp_path / "sim.py"
    file.write_text("SEED_VALUES = {\n    'test': 5,\n    'val': 6,\n}\nITERATION_VALUES = {'test': 50}\n")
    with pytest.raises(ConfigError, match=r"sim.py:3:5: SEED_VALUES.val: has no count in ITERATION_VALUES; add one"):
        load_simulation(str(file))


def test_an_unreadable_config_is_one_line() -> None:
    for name in ("a" * 300, f"{'a' * 300}.yml"):
        with pytest.raises(ConfigError, match=f"^{name}: cannot read it: File name too long"):
            load_simulation(name)


def test_unknown_configs_say_what_there_is() -> None:
    with pytest.raises(UnknownNameError, match="no simulation config named 'defalt'; did you mean default"):
        load_simulation("defalt")
    with pytest.raises(UnknownNameError, match="that file does not exist"):
        load_simulation("nowhere.yml")


def test_a_pipe_is_no_config(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.yml")
    with pytest.raises(UnknownNameError, match="that is not a regular file"):
        find_config("collections", str(tmp_path / "pipe.yml"))
