"""What a bench config may say, what becomes of it, and what people get who say something else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gear.config.dump import to_plain
from gear.config.nodes import parse_text
from gear.config.overrides import with_overrides
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import GearError
from gear.verbs.bench.config import settings_of
from gear.verbs.bench.plan import Plan
from gear.verbs.bench.request import BenchRequest
from gear.verbs.bench.run import prepared as prepared_request
from tests.verbs.bench.conftest import FEW

pytestmark = pytest.mark.usefixtures("plugins")

LESSON = f'calibration: {{town: {TINY_TOWN}, scene: "{TINY_SCENES}:truck"}}\n'

Written = Callable[..., Path]


def prepared(config: str | Path, *, out: Path, **given: Any) -> Plan:
    settings = tuple(given.pop("settings", ()))
    return prepared_request(BenchRequest(config=config, out=out, settings=settings, **given))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("tasks:\n  semseg:", "tasks:\n  semsec:", r"bench\.yml:3:3: tasks\.semsec: .*did you mean semseg"),
        ("tiny_segmenter", "tiny_segmentor", r"bench\.yml:5:7: tasks\.semseg\.models\.small: .*tiny_segmenter"),
        ("tiny_segmenter", "tiny_depth", r"tasks\.semseg\.models\.small: model 'tiny_depth' does depth, not semseg"),
        ("{width: 6}", "{widht: 6}", r"bench\.yml:6:7: tasks\.semseg\.models\.second: .*did you mean 'width'"),
        ("plugin: gaussian", "plugin: gausian", r"bench\.yml:8:7: tasks\.semseg\.defenses\.blur: .*gaussian"),
        ("small: {", "a/b: {", r"models: 'a/b' names folders and rows"),
        ("small: {", "random: {", r"bench\.yml:5:7: .*models: 'random' is a reserved name"),
        ("small: {", "none: {", r"models: 'none' is a reserved name"),
        (':double"', ':dubble"', r"bench\.yml:11:3: places\..*did you mean double"),
        (':double"', ':no_billboard"', r"neither a board nor the truck"),
        (':double"', ':board"', r"is named twice"),
        (':truck"', ':board"', r"bench\.yml:12:.*calibration\.scene: .*is also a measured scene"),
        (':truck"', ':trick"', r"calibration\.scene: .*did you mean truck"),
        (LESSON, "", r"bench\.yml:9:7: tasks\.semseg\.defenses\.fpda: must learn first"),
        ("{steps: 2}", "{steps: 0}", r"bench\.yml:14:.*attack\.steps: must be at least 1"),
        ("{steps: 2}", "{plugin: sqare}", r"bench\.yml:14:.*attack\.plugin: .*square"),
        ("{steps: 2}", "{plugin: square}", r"bench\.yml:14:1: attack: .*counted in forward passes"),
        ("{steps: 2}", "{set: {btach: 2}}", r"bench\.yml:14:10: attack\.set: .*did you mean 'batch'"),
        ("{steps: 2}", "{plugin: eot, set: {share: 9}}", r"bench\.yml:14:.* attack\.set: .*share: must be 0\.01 to 1"),
        ("attack: 2", "attack: 0", r"samples\.attack: must be 1 to"),
        ("transfer: true", "transfers: true", r"unknown key \(did you mean 'transfer'\?\)"),
        (
            "      fpda: {set: {false_alarms: 0.2}}",
            "      fpda: {set: {layer: {}}}",
            r"bench\.yml:9:7: .*fpda: .*layer: expected str",
        ),
        ("quality: fast", "qualty: fast", r"bench\.yml:.*did you mean 'quality'"),
        ("quality: fast", "root: thesis", r"bench\.yml:\d+:1: collect: 'root' is decided by the benchmark"),
        ("width_px: 256", "width_px: 7", r"bench\.yml:.*width_px"),
        ("samples:", "weathers: [ClearNon]\nsamples:", r"did you mean ClearNoon"),
    ],
)
def test_what_does_not_fit_is_one_line_with_its_place(
    written: Written, tmp_path: Path, old: str, new: str, said: str
) -> None:
    with pytest.raises(GearError, match=said) as caught:
        prepared(written((old, new)), out=tmp_path / "out")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["quick", "paper"])
def test_configs_that_come_with_gear_fit_together(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    plan = prepared(name, out=tmp_path)
    steps = list(plan.steps())
    assert steps[-1].verb == "evaluate"
    assert len({step.title for step in steps}) == len(steps), "every step can be told from the others"
    outs = [step.arguments["out"] for step in steps]
    assert len(set(outs)) == len(outs), "no two steps write into one folder"


def test_the_config_of_the_documentation_fits_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    page = (Path(__file__).parents[3] / "docs/how-to/run-a-bench.md").read_text()
    (tmp_path / "page.yml").write_text(page.split("```yaml bench\n")[1].split("```")[0])
    plan = prepared(tmp_path / "page.yml", out=tmp_path / "out")
    assert [model.label for model in plan.plugins_of_tasks[0].models] == ["ddrnet23_slim", "mine"]
    assert len(plan.scenes) == 3 + 7 and len(plan.weathers) == 2


def arguments(plan: Plan, verb: str) -> list[dict[str, Any]]:
    return [step.arguments for step in plan.steps() if step.verb == verb]


LEARNS = (
    "      fpda: {set: {false_alarms: 0.2}}\n",
    "      fpda: {set: {false_alarms: 0.2}}\n      zmask: {set: {false_alarms: 0.2}}\n",
)
"""A change that adds a defense that learns and changes pictures."""


def test_every_step_finds_what_it_needs(written: Written, tmp_path: Path) -> None:
    done: set[str] = set()
    for step in prepared(written(LEARNS), out=tmp_path / "out").steps():
        given = step.arguments
        needed = [*given.get("data", []), *given.get("val", [])]
        needed += [given[key] for key in ("calibration", "calibration_patched") if key in given]
        needed += [given["patch"]] if given.get("patch", "none") not in ("none", "random") else []
        assert set(needed) <= done, step.title
        done.add(given["out"])
    assert done


def test_no_two_purposes_show_the_same_pictures(written: Written, tmp_path: Path) -> None:
    plan = prepared(written(), out=tmp_path / "out")
    seeds: dict[tuple[str, str], set[int]] = {}
    for given in arguments(plan, "collect"):
        seeds.setdefault((given["split"], given["scene"]), set()).add(given["seed"])
    assert all(len(one) == 1 for one in seeds.values()), "every patch is seen in the same pictures"
    assert len({plan.seed(purpose) for purpose in ("attack", "choose", "measure", "calibrate")}) == 4
    other = prepared(written(), out=tmp_path / "out", settings=["seed=1"])
    assert {plan.seed("measure"), plan.seed("attack")}.isdisjoint({other.seed("measure"), other.seed("attack")})
    learns = [given for given in arguments(plan, "evaluate") if given.get("defense") == "fpda"]
    assert all("truck" in given["calibration"] and "truck" in given["calibration_patched"] for given in learns)


def test_patches_look_through_defenses_only_if_they_are_to(written: Written, tmp_path: Path) -> None:
    through = [given.get("defense") for given in arguments(prepared(written(), out=tmp_path), "attack")]
    assert through.count("gaussian") == 4 and through.count("fpda") == 4
    by_queries = prepared(written(("attack: {steps: 2}", "attack: {plugin: square, queries: 8}")), out=tmp_path)
    through = [given.get("defense") for given in arguments(by_queries, "attack")]
    assert through.count("gaussian") == 4 and "fpda" not in through, "queries see no score of a defense"
    learnt = arguments(prepared(written(LEARNS), out=tmp_path), "attack")
    assert [given.get("defense") for given in learnt].count("zmask") == 4
    assert all(("calibration_patched" in given) == (given.get("defense") in ("fpda", "zmask")) for given in learnt)
    plain = prepared(written(("adaptive: true", "adaptive: false")), out=tmp_path)
    assert all("defense" not in given for given in arguments(plain, "attack"))


def test_probes_are_collected_for_those_that_need_them(written: Written, tmp_path: Path) -> None:
    exact, plain = (
        arguments(prepared(written(*FEW, ("steps: 2", change)), out=tmp_path), "collect")
        for change in ("steps: 2", "steps: 2, compositor: homography")
    )
    assert [given.get("probes", False) for given in exact] == [True, True, False, False, False]
    assert not any("probes" in given for given in plain)


def test_where_networks_run(written: Written, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tiny = prepared(written(), out=tmp_path, device="cuda")  # which have no such option
    assert all("device=cuda" not in given["model_settings"] for given in arguments(tiny, "evaluate"))
    monkeypatch.undo()
    shipped = prepared("quick", out=tmp_path, device="cuda")
    assert all("device=cuda" in given["model_settings"] for given in arguments(shipped, "evaluate"))
    assert all("device=cuda" in given["model_settings"] for given in arguments(shipped, "attack"))


@pytest.mark.parametrize(
    "text",
    [
        "{a: 1, b: {c: x, d: [1, 2]}}",
        "{a: '#1', b: 'it''s', c: ' spaced ', d: '', e: null, f: 'null', g: '[1]', h: 'k: v'}",
        "{a: 'C:', b: '@here/w', c: '%w', d: '? x', e: '- x', f: -0.5, g: '-', h: 'a: b: c', i: '---', j: 1e-5}",
        "{a: ['x, y', {b: 2}], 'weights': 'runs/a b/model.safetensors'}",
    ],
)
def test_settings_set_what_the_file_says(text: str) -> None:
    node = parse_text(text, "file")
    again = with_overrides(parse_text("{}", "nothing"), settings_of(node))
    assert to_plain(again) == to_plain(node)


def test_weathers_have_names_of_their_own(written: Written, tmp_path: Path) -> None:
    given = "weathers: [ClearNoon, {preset: ClearNoon, cloudiness: 30}, {preset: ClearNoon, cloudiness: 60}]\nsamples"
    plan = prepared(written(*FEW, ("\nsamples", "\n" + given)), out=tmp_path)
    assert [weather.label for weather in plan.weathers] == ["ClearNoon", "ClearNoon-changed", "ClearNoon-changed-again"]
    assert plan.weathers[1].settings == ("weather.preset=ClearNoon", "weather.cloudiness=30.0")
    (made,) = arguments(plan, "attack")
    assert len(made["data"]) == len(made["val"]) == 3


def test_towns_scenes_are_those_that_show_patches(tmp_path: Path, written: Written) -> None:
    plan = prepared(written(*FEW, (f'{TINY_TOWN}: ["{TINY_SCENES}:board"]', "town10: []")), out=tmp_path)
    names = [scene.name for scene in plan.scenes]
    assert "billboard01" in names and "truck" in names and "no_billboard" not in names and len(names) == 10


def test_networks_for_another_camera_are_an_error_before_rendering(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.undo()
    tasks = "tasks: {stereo3d: {models: {stereo_centre: {}}, collect: {options: {hfov_deg: 60}}}}"
    (tmp_path / "b.yml").write_text(f"{tasks}\nplaces: {{town10: [truck]}}\n")
    key = "tasks.stereo3d.models.stereo_centre"
    with pytest.raises(
        GearError, match=rf"b\.yml:1:29: {key}: .*with hfov_deg 60, .*say --set {key}\.set\.hfov_deg=60"
    ):
        prepared(tmp_path / "b.yml", out=tmp_path / "out")
    assert prepared(tmp_path / "b.yml", out=tmp_path / "out", settings=[f"{key}.set.hfov_deg=60"])


def test_attacks_make_as_many_patches_as_scenes_show(written: Written, tmp_path: Path) -> None:
    plan = prepared(written(), out=tmp_path)
    assert [scene.surfaces for scene in plan.scenes] == [1, 2]
