"""`gear attack` on a tiny town and tiny networks: files, resuming, several models, defenses, and what is refused."""

from __future__ import annotations

import dataclasses
import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import torch
from safetensors.numpy import load_file
from safetensors.numpy import save as to_bytes

import gear
from gear.cli.main import main
from gear.compositor.cache import Cache
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.attacks import Patch
from gear.contracts.specs import AttackSpec
from gear.measuring.sample_figures import CELL_WIDTH_PX
from gear.plugins import build as building
from gear.plugins.attacks.optimisation.objectives import SemsegObjective
from gear.plugins.attacks.scene_specific import SceneSpecificConfig
from gear.testing.compare import difference
from gear.testing.tiny_networks import TinyConfig, TinySegmenter, tiny_segmenter
from gear.values.errors import DatasetError, GearError, PluginError
from gear.verbs.attack import folder
from gear.verbs.attack.monitor import CHECKPOINT, Recorder
from gear.verbs.attack.run import attack
from gear.verbs.attack.scenes import Scenes
from tests.verbs.attack.conftest import SMALL
from tests.verbs.conftest import Install, Nothing, Small


class Bad:
    """Returns, or does, what it must not."""

    def __init__(self, what: str) -> None:
        self.what = what

    def optimise(self, model: Any, dataset: Any, compositor: Any, **rest: Any) -> Any:
        if self.what == "changes the model":
            next(model.parameters()).data.add_(1.0)
        rgb = np.full((4, 8, 3), 2.0 if self.what == "leaves the range" else 0.5, np.float32)
        return (Patch(name="poster" if self.what == "misnames" else "patch_0", rgb=rgb),)


def bad(what: str) -> AttackSpec[Any]:
    return AttackSpec(name="bad", summary="Bad.", config=Nothing, build=lambda config: Bad(what))


def test_a_damaged_attack_file_is_one_line(small: Small, install: Install, tmp_path: Path) -> None:
    data, out = small(), tmp_path / "patches"
    attack(data, model="tiny_segmenter", out=out, steps=2, settings=SMALL)
    path = out / "attack.json"
    notes = json.loads(path.read_text())
    changed: list[Any] = [{key: value for key, value in notes.items() if key != gone} for gone in folder.READ_BACK]
    changed += [notes | {key: [None]} for key in folder.READ_BACK] + [
        notes | {"gradient_check": {}},
        notes | {"patches": None},
    ]
    (digest,) = notes["patches"].values()
    changed += [notes | {"patches": {"../patches/patch_0": digest}}]
    for text in (*map(json.dumps, changed), "[" * 200_000):
        path.write_text(text)
        with pytest.raises(DatasetError, match=r"attack\.json: is gone, damaged"):
            attack(data, model="tiny_segmenter", out=out, steps=2, settings=SMALL)
    path.write_text(json.dumps(notes))
    exact = np.zeros((4, 8, 3), np.float32)
    for arrays in ({}, {"patch_1": exact}, {"patch_0": exact[0]}, {"patch_0": exact.astype(np.float64)}):
        (out / "patch.safetensors").write_bytes(to_bytes(arrays))
        with pytest.raises(DatasetError, match=r"patch\.safetensors: is gone, damaged"):
            attack(data, model="tiny_segmenter", out=out, steps=2, settings=SMALL)


@pytest.mark.parametrize(
    "notes",
    ["[]", "{", "[" * 100_000, '{"key": 1}', {"done": "two"}, {"curves": [1]}, {"judged": [[1]]}, {"seconds": None}],
)
def test_a_checkpoint_that_says_something_else_is_one_line(tmp_path: Path, notes: Any) -> None:
    whole = {"key": "k", "done": 2, "queries_left": None, "curves": {"a": [1.0]}, "judged": [], "seconds": 1.0}
    text = notes if isinstance(notes, str) else json.dumps(whole | notes)
    (tmp_path / CHECKPOINT).write_bytes(to_bytes({"state/a": np.zeros(1, np.float32)}, {"notes": text}))
    with pytest.raises(DatasetError, match=r"checkpoint\.safetensors: is damaged \(.*\); delete it to start afresh$"):
        Recorder(root=tmp_path, key="k", steps=4).resume()


@pytest.mark.parametrize(
    "best",
    [{}, {"best/patch_0": np.zeros((2, 2), np.float32)}, {"best/patch_0": np.full((2, 2, 3), np.nan, np.float32)}],
)
def test_a_checkpoint_whose_best_patches_are_none_is_one_line(tmp_path: Path, best: Any) -> None:
    notes = {"key": "k", "done": 2, "queries_left": None, "curves": {}, "judged": [[2, 0.5]], "seconds": 1.0}
    arrays = {"state/a": np.zeros(1, np.float32), **best}
    (tmp_path / CHECKPOINT).write_bytes(to_bytes(arrays, {"notes": json.dumps(notes)}))
    with pytest.raises(DatasetError, match=r"checkpoint\.safetensors: is damaged \(.*\); delete it to start afresh$"):
        Recorder(root=tmp_path, key="k", steps=4).resume()


def test_a_patch_folder_is_whole(small: Small, install: Install, tmp_path: Path) -> None:
    data, out = small(), tmp_path / "patches"
    report = attack(data, model="tiny_segmenter", out=out, steps=4, settings=SMALL)
    assert report.made and [patch.name for patch in report.patches] == ["patch_0"]
    assert not (out / "gear").exists()
    picture = cv2.imread(str(out / "patch_0.png"))[..., ::-1]
    exact = load_file(out / "patch.safetensors")["patch_0"]
    assert exact.shape == (12, 24, 3) and exact.dtype == np.float32
    assert np.array_equal(picture, np.floor(exact * 255 + 0.5).astype(np.uint8))
    notes = json.loads((out / "attack.json").read_text())
    assert notes["models"][0]["name"] == "tiny_segmenter" and len(notes["weights_sha256"]) == 64
    assert notes["steps_done"] == 4 and all(len(curve) == 4 for curve in notes["curves"].values())
    assert notes["gradient"]["least"] > 0 and notes["gradient"]["zero_steps"] == 0
    assert notes["gradient_check"]["measured_change"] == pytest.approx(
        notes["gradient_check"]["predicted_change"], rel=0.5
    )
    assert cv2.imread(str(out / "figures" / "curves.png")).shape[0] > 100
    drawn = cv2.imread(str(out / "figures" / "samples.png"))
    assert drawn.shape[0] > 4 * 240 and drawn.shape[1] == 3 * CELL_WIDTH_PX  # two samples, without and with the patch
    assert not (out / CHECKPOINT).exists()
    achieved = notes["achieved"]["training"]
    assert (
        achieved["samples"] == 2 and achieved["patch"] > achieved["random"] and notes["achieved"]["validation"] is None
    )
    said = (
        f"objective on 2 training samples: {achieved['random']:.4g} with random patches, {achieved['patch']:.4g} with"
    )
    assert "4 steps" in report.summary() and said in report.summary()


def test_what_is_there_is_not_made_again(small: Small, install: Install, tmp_path: Path) -> None:
    data, out = small(), tmp_path / "patches"
    first = attack(data, model="tiny_segmenter", out=out, steps=2, settings=SMALL)
    stamp = (out / "patch_0.png").stat().st_mtime_ns
    again = attack(data, model="tiny_segmenter", out=out, steps=2, settings=SMALL)
    assert not again.made and (out / "patch_0.png").stat().st_mtime_ns == stamp
    assert not difference(first.patches, again.patches, "patches")
    with pytest.raises(DatasetError, match=r"made with other settings \(steps: 2 there, 3 now\)"):
        attack(data, model="tiny_segmenter", out=out, steps=3, settings=SMALL)
    assert attack(data, model="tiny_segmenter", out=out, steps=3, settings=SMALL, force=True).made


def test_a_killed_attack_goes_on(
    small: Small, install: Install, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = attack(small(), model="tiny_segmenter", out=tmp_path / "whole", steps=5, settings=SMALL)
    monkeypatch.setattr("gear.verbs.attack.monitor.SECONDS_BETWEEN", 0.0)

    def killed(done: int, total: int) -> None:
        if done == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        attack(small(), model="tiny_segmenter", out=tmp_path / "cut", steps=5, settings=SMALL, on_progress=killed)
    assert (tmp_path / "cut" / CHECKPOINT).exists() and not (tmp_path / "cut" / "attack.json").exists()
    with pytest.raises(DatasetError, match="unfinished attack with other settings"):
        attack(small(), model="tiny_segmenter", out=tmp_path / "cut", steps=6, settings=SMALL)
    seen: list[int] = []
    resumed = attack(
        small(), model="tiny_segmenter", out=tmp_path / "cut", steps=5, settings=SMALL,
        on_progress=lambda done, total: seen.append(done),
    )  # fmt: skip
    assert min(done for done in seen if done) == 3, "steps that were done are not done again"
    assert not difference(resumed.patches, whole.patches, "patches")
    assert resumed.facts["curves"] == whole.facts["curves"]


def test_double_boards_get_a_patch_each(small: Small, install: Install, tmp_path: Path) -> None:
    report = attack(small(scene="double"), model="tiny_segmenter", out=tmp_path, steps=2, settings=SMALL)
    assert [patch.name for patch in report.patches] == ["patch_0", "patch_1"]
    assert not np.array_equal(report.patches[0].rgb, report.patches[1].rgb)


def test_depth_too(small: Small, install: Install, tmp_path: Path) -> None:
    report = attack(small("depth"), model="tiny_depth", out=tmp_path, steps=2, settings=[*SMALL, "direction=farther"])
    assert set(report.facts["curves"]) == {"farther", "gradient", "smoothness"}


def test_several_models_and_scenes_at_once(small: Small, install: Install, tmp_path: Path) -> None:
    report = attack(
        [small(), small(scene="truck")], model=["tiny_segmenter", "other_segmenter"], out=tmp_path, steps=3,
        settings=SMALL,
    )  # fmt: skip
    names = set(report.facts["curves"])
    assert any(name.startswith("tiny_segmenter/") for name in names)
    assert any(name.startswith("other_segmenter/") for name in names)
    assert [one["scene"] for one in report.facts["data"]] == ["tiny/board", "tiny/truck"]


def test_the_best_on_validation_is_kept(small: Small, install: Install, tmp_path: Path) -> None:
    report = attack(
        small(), model="tiny_segmenter", out=tmp_path, steps=6, settings=SMALL, val=small(split="val"), every=2
    )
    assert [step for step, _ in report.facts["validation_harm"]] == [2, 4, 6]
    held_out = report.facts["achieved"]["validation"]
    assert held_out["patch"] == max(harm for _, harm in report.facts["validation_harm"])
    assert f"objective on {held_out['samples']} validation samples: " in report.summary()


def test_homography_needs_no_probes(small: Small, install: Install, tmp_path: Path) -> None:
    data = small(probes=False)
    with pytest.raises(DatasetError, match="probes"):
        attack(data, model="tiny_segmenter", out=tmp_path / "a", steps=1, settings=SMALL)
    assert attack(
        data, model="tiny_segmenter", out=tmp_path / "b", steps=1, settings=SMALL, compositor="homography"
    ).made


@pytest.mark.parametrize("what", ["changes the model", "leaves the range", "misnames"])
def test_an_attack_that_breaks_its_promise_is_named(small: Small, install: Install, tmp_path: Path, what: str) -> None:
    install(tiny_segmenter, bad(what))
    with pytest.raises(PluginError, match="bad"):
        attack(small(), model="tiny_segmenter", out=tmp_path, attack="bad", steps=1)
    assert not list(tmp_path.glob("*.png")) and not (tmp_path / "attack.json").exists()


class BadOnTheWay:
    """Shows its monitor what it would not return."""

    def optimise(self, model: Any, dataset: Any, compositor: Any, *, monitor: Any, **rest: Any) -> Any:
        bright, grey = ((Patch(name="patch_0", rgb=np.full((4, 8, 3), v, np.float32)),) for v in (2.0, 0.5))
        monitor.step(1, {"a": 0.0}, lambda: bright, dict)
        return grey


def test_the_best_patches_are_held_to_the_promise_too(small: Small, install: Install, tmp_path: Path) -> None:
    spec = AttackSpec(name="bad", summary="Bad.", config=Nothing, build=lambda config: BadOnTheWay())
    install(tiny_segmenter, spec)
    with pytest.raises(PluginError, match=r"bad.*patch_0 leaves 0\.\.1"):
        attack(small(), model="tiny_segmenter", out=tmp_path, attack="bad", steps=1, val=small(split="val"))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"model": "tiny_depth"}, "is a semseg dataset"),
        ({"model": "tiny_segmentor"}, "tiny_segmenter"),
        ({"model": ["tiny_segmenter", "tiny_segmenter"]}, "twice"),
        ({"attack": "scene_spesific"}, "scene_specific"),
        ({"steps": 0}, "at least 1"),
        ({"defense": "bit_dept"}, "bit_depth"),
        ({"defense_settings": ["bits=3"]}, "there is no defense"),
        ({"patience": 3}, "needs validation data; give --val"),
        ({"compositor": "glue"}, "transport"),
        ({"settings": ["learning_rate=-1"]}, "learning_rate"),
    ],
)
def test_bad_wishes_get_a_line(
    small: Small, install: Install, tmp_path: Path, changes: Mapping[str, Any], message: str
) -> None:
    wishes: dict[str, Any] = {"model": "tiny_segmenter", "steps": 1, "settings": SMALL, **changes}
    with pytest.raises(GearError, match=message):
        attack(small(), out=tmp_path / "out", **wishes)


@pytest.mark.parametrize("plan", ["[]", "{}", '{"task": "semseg"}'])
def test_a_plan_that_names_no_task_is_one_line(small: Small, install: Install, tmp_path: Path, plan: str) -> None:
    data = shutil.copytree(small(), tmp_path / "data")
    (path,) = data.glob("gear/*/plan.json")
    path.write_text(plan)
    with pytest.raises(DatasetError, match=r"plan\.json: is damaged \(plan.*gear verify DIR --repair"):
        attack(data, model="tiny_segmenter", out=tmp_path / "x", steps=1, settings=SMALL)


def test_test_splits_and_empty_scenes_are_refused(small: Small, install: Install, tmp_path: Path) -> None:
    with pytest.raises(GearError, match="tested on"):
        attack(small(split="test"), model="tiny_segmenter", out=tmp_path, steps=1)
    with pytest.raises(DatasetError, match="no patch surface"):
        attack(small(scene="no_billboard", probes=False), model="tiny_segmenter", out=tmp_path, steps=1)
    with pytest.raises(DatasetError, match="no dataset"):
        attack(tmp_path, model="tiny_segmenter", out=tmp_path / "x", steps=1)
    with pytest.raises(DatasetError, match="is a dataset; make patches in a folder of their own"):
        attack(small(), model="tiny_segmenter", out=small(), steps=1)


def test_on_the_command_line(
    small: Small, install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [
        "attack",
        "--model",
        "tiny_segmenter",
        "--data",
        str(small()),
        "--steps",
        "2",
        "--out",
        str(tmp_path / "p"),
    ]
    assert main([*words, *(f"--set={text}" for text in SMALL), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["steps_done"] == 2
    assert main([*words, "--set", "batch=0"]) == 2
    line = capsys.readouterr().err.strip()
    assert "\n" not in line and "batch" in line


@pytest.mark.parametrize("name", ["eot", "control"])
def test_what_knows_no_scene_needs_no_probes(small: Small, install: Install, tmp_path: Path, name: str) -> None:
    data = small(probes=False)
    report = attack(data, model="tiny_segmenter", out=tmp_path / "a", attack=name, steps=1, settings=SMALL[:2])
    assert report.facts["compositor"] == "homography" and (tmp_path / "a" / "figures" / "samples.png").is_file()
    with pytest.raises(DatasetError, match="has no probes; collect it with --probes, or attack with --compositor"):
        attack(data, model="tiny_segmenter", out=tmp_path / "b", steps=1)
    assert not (tmp_path / "b").exists()


def test_a_folder_that_is_not_whole_is_not_taken_for_it(small: Small, install: Install, tmp_path: Path) -> None:
    facts: dict[str, Any] = {"model": "tiny_segmenter", "steps": 1, "settings": SMALL}
    for name, content in (
        ("attack.json", b"[]"),
        ("attack.json", b'{"att'),
        ("patch_0.png", b""),
        ("patch_0.png", None),
        ("patch.safetensors", b"half"),
        ("patch.safetensors", None),
    ):
        out = tmp_path / "p"
        attack(small(), out=out, **facts, force=True)
        if content is None:
            (out / name).unlink()
        else:
            (out / name).write_bytes(content)
        with pytest.raises(GearError, match=f"{name}.*(--force|can be read)"):
            attack(small(), out=out, **facts)
    (tmp_path / "file").write_text("")
    with pytest.raises(GearError):
        attack(small(), out=tmp_path / "file", **facts, force=True)


def test_patches_against_other_weights_are_others(small: Small, install: Install, tmp_path: Path) -> None:
    out = tmp_path / "p"
    first = attack(small(), model="tiny_segmenter", out=out, steps=2, settings=SMALL)

    def retrained(config: Any) -> TinySegmenter:
        network = TinySegmenter(config)
        next(network.parameters()).data.mul_(1.5)
        return network

    install(dataclasses.replace(tiny_segmenter, build=retrained))
    with pytest.raises(DatasetError, match="made with other settings"):
        attack(small(), model="tiny_segmenter", out=out, steps=2, settings=SMALL)
    (out / "patch_1.png").write_bytes(b"of another attack")
    (out / "verify").mkdir()
    second = attack(small(), model="tiny_segmenter", out=out, steps=2, settings=SMALL, force=True)
    assert second.facts["weights_sha256"] != first.facts["weights_sha256"]
    assert not (out / "patch_1.png").exists() and not (out / "verify").exists()


def lucky(config: TinyConfig) -> TinySegmenter:
    """Often right around the board: it takes most for sky."""
    network = TinySegmenter(config)
    with torch.no_grad():
        network.head.bias[23] += 2
    return network


def test_validation_is_by_the_attacks_own_objective(small: Small, install: Install, tmp_path: Path) -> None:
    install(dataclasses.replace(tiny_segmenter, build=lucky))
    val = small(split="val")
    facts: dict[str, Any] = {"model": "tiny_segmenter", "val": val, "steps": 1, "every": 1, "settings": SMALL[:2]}
    paper = attack(small(), out=tmp_path / "paper", attack="carla_gear", **facts)
    gears = attack(small(), out=tmp_path / "gears", **facts)
    assert paper.facts["settings"]["batch"] == 2 and not paper.facts["settings"]["decay"]
    assert paper.facts["settings"]["learning_rate"] == pytest.approx([0.1145, 0.112, 0.1125])
    assert gears.facts["settings"]["learning_rate"] == 0.06
    assert gears.facts["attack"]["options"]["learning_rate"] is None
    scenes, network = Scenes([gear.open_dataset(val)], "transport", "cpu", Cache(1 << 20)), lucky(TinyConfig())
    for report, objective in ((paper, SemsegObjective(gamma=1.0)), (gears, SemsegObjective())):
        wanted = scenes.harm(network, objective, report.patches)
        assert report.facts["validation_harm"][0][1] == pytest.approx(wanted, rel=1e-4)
    foreign = scenes.harm(network, SemsegObjective(), paper.patches)
    assert paper.facts["validation_harm"][0][1] != pytest.approx(foreign, rel=1e-3)


def test_what_is_not_there_to_be_attacked_is_said(small: Small, install: Install, tmp_path: Path) -> None:
    facts: dict[str, Any] = {"model": "tiny_segmenter", "out": tmp_path / "x", "steps": 1}
    for name in ("scene_specific", "rp2"):
        with pytest.raises(GearError, match="none of the 2 pictures show train; name another class"):
            attack(small(), attack=name, settings=[*SMALL, "source_class=train", "target=road"], **facts)


def test_a_control_takes_no_steps(small: Small, install: Install, tmp_path: Path) -> None:
    report = attack(small(), model="tiny_segmenter", out=tmp_path, attack="control", settings=SMALL[:2])
    assert (report.facts["steps_done"], report.facts["steps_per_s"], report.facts["gradient_check"]) == (0, None, None)
    first, then = report.summary().splitlines()
    assert first == f"{tmp_path}: 1 patch after 0 steps"
    command = f"gear collect --task semseg --scene SCENES.yml:board --split test --town TOWN.xml --patch {tmp_path}"
    assert then == f"next: {command} (TOWN.xml and SCENES.yml: the files of the town)"
    assert report.facts["achieved"] is None


def test_a_control_is_like_what_is_there_now(small: Small, install: Install, tmp_path: Path) -> None:
    def made(name: str, *settings: str, **facts: Any) -> Any:
        out = tmp_path / name
        return attack(small(), model="tiny_segmenter", out=out, attack="control", settings=settings, **facts)

    made("like", "kind=solid", "rgb=[0.1,0.2,0.3]", *SMALL[:2])
    matched = ("kind=matched", f"reference_patches={tmp_path / 'like'}")
    made("control", *matched)
    assert not made("control", *matched).made
    made("like", "kind=solid", "rgb=[0.9,0.9,0.9]", *SMALL[:2], force=True)
    with pytest.raises(DatasetError, match="made with other settings"):
        made("control", *matched)


@pytest.mark.parametrize("setting", ["goal=vanish", "direction=farther", "losses.cross_entropy=-"])
def test_options_of_other_tasks_are_refused(small: Small, install: Install, tmp_path: Path, setting: str) -> None:
    with pytest.raises(GearError, match=f"option {setting.partition('=')[0].partition('.')[0]} of the attack is for"):
        attack(small(), model="tiny_segmenter", out=tmp_path / "x", steps=1, settings=[*SMALL, setting])


def test_a_minus_is_no_list() -> None:
    config = read_node(SceneSpecificConfig, with_overrides(building.NO_OPTIONS, ["losses.bbox_regression=-"]), "")
    assert config.losses == {"bbox_regression": "-"}


@pytest.mark.parametrize("found", [(float("nan"), 1.0), (1.0, float("inf"))])
def test_a_check_that_comes_to_no_number_is_none(
    small: Small, install: Install, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, found: tuple[float, float]
) -> None:
    monkeypatch.setattr(Scenes, "gradient_check", lambda *asked: found)
    report = attack(small(), model="tiny_segmenter", out=tmp_path, steps=1, settings=SMALL)
    assert report.facts["gradient_check"] is None and (tmp_path / "attack.json").exists()


def test_a_look_at_validation_samples_changes_no_check(small: Small, install: Install, tmp_path: Path) -> None:
    """Clean answers are remembered by sample number; those of other data sets must not be taken for them."""
    train, val = small("depth"), small("depth", split="val")
    plain = attack(train, model="tiny_depth", out=tmp_path / "a", steps=1, settings=SMALL)
    judged = attack(train, model="tiny_depth", out=tmp_path / "b", steps=1, settings=SMALL, val=val, every=1)
    assert not difference(plain.patches, judged.patches, "patches")
    assert judged.facts["gradient_check"] == plain.facts["gradient_check"] is not None


class Failing(TinySegmenter):
    def forward(self, views: Any, targets: Any = None) -> Any:
        raise RuntimeError("out of ideas")


def test_a_third_partys_network_that_fails_is_named(small: Small, install: Install, tmp_path: Path) -> None:
    install(dataclasses.replace(tiny_segmenter, build=Failing))
    with pytest.raises(PluginError, match=r"tiny_segmenter \(.*failed at forward: RuntimeError: out of ideas"):
        attack(small(), model="tiny_segmenter", out=tmp_path / "p", steps=1, settings=SMALL)


class Misnaming(TinySegmenter):
    def forward(self, views: Any, targets: Any = None) -> Any:
        return {"classes": super().forward(views)["logits"]}


def test_a_network_without_the_output_for_attacks_is_an_error(small: Small, install: Install, tmp_path: Path) -> None:
    install(dataclasses.replace(tiny_segmenter, build=Misnaming))
    with pytest.raises(GearError, match=r"works on the output 'logits', and the network gives classes"):
        attack(small(), model="tiny_segmenter", out=tmp_path / "p", steps=1, settings=SMALL)


class Foreign(TinySegmenter):
    def forward(self, views: Any, targets: Any = None) -> Any:
        return {"logits": super().forward(views)["logits"][:, :21]}


@pytest.mark.parametrize("setting", ["gamma=-1", "gamma=0.5", "target=road"])
def test_a_network_with_other_classes_is_an_error(small: Small, install: Install, tmp_path: Path, setting: str) -> None:
    install(dataclasses.replace(tiny_segmenter, build=Foreign))
    with pytest.raises(GearError, match="19 train ids or 34 label ids, and the network gives 21 classes"):
        attack(small(), model="tiny_segmenter", out=tmp_path / "p", steps=1, settings=[*SMALL, setting])
