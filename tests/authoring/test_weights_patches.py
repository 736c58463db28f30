"""The production of the pre-computed patches: plans, the figures, installing, and all of it on a tiny town."""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import types
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import pytest

from authoring.weights.patches import command
from authoring.weights.patches.install import install
from authoring.weights.patches.plan import FIRST_SEEDS, PatchPlan, model_settings, plans
from authoring.weights.patches.run import EFFECT, make_patch, measure_again
from authoring.weights.patches.summary import is_clearly_worse, table
from authoring.weights.plan import TRAINING_OPTIONS, held_out, training
from gear.cli.main import main
from gear.collecting.job import resolve
from gear.collecting.patch_sources import resolve_patch
from gear.config.collection import SimulationConfig
from gear.config.load import find_config, load_collection
from gear.config.nodes import parse_file
from gear.config.reader import read_node
from gear.contracts.hookspecs import hookimpl
from gear.dataset.files import write_alone
from gear.dataset.json_text import dump_json
from gear.measuring.gap.picture_gap import PictureGap
from gear.measuring.gap.report import GapReport, SampleGap
from gear.plugins import build as building
from gear.plugins.manager import discover
from gear.testing.tiny_networks import tiny_segmenter
from gear.testing.tiny_town import TINY_SCENES, TINY_TOWN
from gear.values.errors import GearError, UnknownNameError
from gear.verbs.evaluate.report import Difference, Estimate, EvaluateReport, PairedTest, RowReport

MODELS = {
    "semseg": "ddrnet23_slim", "depth": "ddrnet23_slim_depth", "detect2d": "retinanet_r18_fpn",
    "stereo3d": "stereo_centre_lite0",
}  # fmt: skip
TINY = (
    f"scenes={TINY_SCENES}", "renderer=classic", "quality=fast", "options.width_px=320", "options.height_px=160",
    "options.polygons=false",
)  # fmt: skip


def of(task: str, **changes: Any) -> list[PatchPlan]:
    return plans(task, MODELS[task], weights="none", **changes)


def test_seeds_are_not_used_elsewhere() -> None:
    simulation = read_node(SimulationConfig, parse_file(find_config("simulation", "default")))
    others = {split.seed for split in simulation.splits.values()}
    others |= {one.seed for one in (*training("semseg", 1000), *held_out("semseg"))}
    chosen = of("semseg")
    mine = [plan.seed(split) for plan in chosen for split in FIRST_SEEDS]
    assert len(set(mine)) == len(mine) and not others & set(mine)
    (one,) = of("semseg", towns=["harbour"], scenes=["truck"])
    assert one == next(plan for plan in chosen if plan.place == "harbour-truck"), "what else is made decides nothing"


def test_every_scene_with_a_surface_has_one() -> None:
    names = [plan.place for plan in of("semseg")]
    assert len(set(names)) == len(names) and {"town10-billboard07", "suburb-truck"} <= set(names)
    assert not [name for name in names if "no_billboard" in name]


@pytest.mark.parametrize("task", MODELS)
def test_collections_can_be_made_and_twins_are_twins(task: str) -> None:
    plan = of(task)[3]
    steps = {step.name: list(step.arguments) for step in plan.commands(Path("out"))}
    keys = set()
    for name in ("none", "random", "val"):
        words = iter(steps[f"collect {name}"][1:])
        flags = {
            word: "true" if word == "--probes" else next(words) for word in words if word != "--set" or not next(words)
        }
        flags = {flag.removeprefix("--"): text for flag, text in flags.items() if flag != "--out"}
        job = resolve(load_collection(None, flags, plan.settings))
        keys.add((name == "val", job.plan.twin_key))
    assert len(keys) == 2, "none and random share theirs, val has its own"
    assert "outside_patch" in steps["evaluate"]
    assert "--allow-test-data" not in steps["attack"] and "weights=none" in steps["attack"]


@pytest.mark.parametrize("task", MODELS)
def test_every_command_is_one_that_gear_understands(task: str) -> None:
    plan = replace(of(task)[0], attack_settings=("batch=1",))
    for step in (*plan.commands(Path("out")), *plan.commands_again(Path("again"))):
        parser = argparse.ArgumentParser(exit_on_error=False)
        importlib.import_module(f"gear.cli.commands.{step.arguments[0]}").add_arguments(parser)
        args = parser.parse_args(step.arguments[1:])
        if step.name == "evaluate":
            folders = [f"{Path(args.out).parent}/{kind}" for kind in ("none", "random", "patched")]
            assert args.data == folders and args.model_settings == ["weights=none"]
        if step.name == "attack":
            assert (args.settings, args.model_settings, args.every) == (["batch=1"], ["weights=none"], 25)
        if step.name == "gap":
            twins = [f"{Path(args.out).parent}/{kind}" for kind in ("none", "patched")]
            assert [args.dataset, args.twin] == twins and args.compositors == ["transport"]


def test_the_attack_alone_runs_at_half_precision() -> None:
    (plan,) = of("semseg", towns=["suburb"], scenes=["truck"], precision="bfloat16")
    told = [step.name for step in plan.commands(Path("out")) if "precision=bfloat16" in step.arguments]
    assert told == ["attack"]


def test_small_pictures_are_seen_at_the_size_that_the_weights_know(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("authoring.weights.patches.plan.trained_option", lambda *_: 0.75)
    told = model_settings("semseg", "ddrnet23_slim", "net.safetensors", TRAINING_OPTIONS["semseg"])
    assert told == ("weights=net.safetensors", "input_scale=1")
    assert model_settings("semseg", "ddrnet23_slim", "shipped", ()) == ()
    assert model_settings("stereo3d", "stereo_centre_lite0", "shipped", TRAINING_OPTIONS["stereo3d"]) == ()


def test_what_cannot_be_made_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="did you mean billboard01"):
        of("semseg", scenes=["bilboard01"])
    with pytest.raises(UnknownNameError, match="did you mean town10"):
        of("semseg", towns=["town1"])
    with pytest.raises(GearError, match="does semseg, not depth"):
        plans("depth", "ddrnet23_slim")
    with pytest.raises(GearError, match="at least 1"):
        of("semseg", steps=0)
    with pytest.raises(GearError, match="there is no such weights file"):
        plans("semseg", "ddrnet23_slim", weights="nowhere.safetensors")
    for flags in (["--weights", "none"], ["--set", "quality=fast"]):
        parser = argparse.ArgumentParser()
        command.add_arguments(parser)
        args = parser.parse_args(["--task", "semseg", "--model", "ddrnet23_slim", "--out", "x", "--install", *flags])
        with pytest.raises(GearError, match="--install is for patches"):
            command.run(args)
    with pytest.raises(GearError, match="--again measures installed patches"):
        command.run(
            argparse.Namespace(**vars(args) | {"install": False, "settings": [], "again": True, "weights": "none"})
        )


def effect(**changes: Any) -> dict[str, Any]:
    found: dict[str, Any] = {
        "patch": "net-town-a", "task": "semseg", "model": "net", "scene": "town-a",
        "metric": {"figure": "miou", "none": 0.7, "random": 0.68, "patched": 0.5},
        "outside": {"figure": "outside_patch.miou", "mean": -0.12, "p": 0.0001, "pairs": 40},
        "effect": {"figure": "miou", "digital": -0.2, "rendered": -0.19, "share": 0.95},
        "psnr_db": 44.31, "minutes": {"attack": 3.0, "all": 7.25},
    }  # fmt: skip
    return found | changes


def test_the_table_counts_what_is_clearly_worse() -> None:
    better = effect(scene="town-b", outside={"figure": "outside_patch.miou", "mean": 0.1, "p": 0.001, "pairs": 40})
    unknown = effect(
        scene="town-c", outside={"figure": "outside_patch.miou", "mean": None, "p": None, "pairs": 0},
        effect={"figure": "miou", "digital": None, "rendered": None, "share": None}, psnr_db=None,
    )  # fmt: skip
    assert [is_clearly_worse(one) for one in (effect(), better, unknown)] == [True, False, False]
    lines = table([effect(), better, unknown]).splitlines()
    assert lines[0] == "semseg: net, miou"
    cells = ["town-a", "0.700", "0.680", "0.500", "-0.120", "0.0001", "-0.200", "-0.190", "0.95", "44.3", "7.2"]
    assert lines[2].split() == cells
    assert lines[-1].endswith("1 of 3 scenes") and lines[4].split()[4:10] == ["-"] * 6
    assert len({len(line) for line in lines[1:-1]}) == 1


def write_results(root: Path, plan: PatchPlan) -> None:
    """What the commands leave, by the classes that write it."""
    values = {"none": 0.7, "random": 0.68, f"{plan.name}-0a1b2c3d": 0.5}
    rows = [
        RowReport(
            name=f"test-{label}", dataset=root, facts={"patch": label}, samples=2, made=2, cost={}, defense={},
            damaged=(),
            metrics={"task": {"miou": Estimate(value=value)}}, per_sample=[],
        )
        for label, value in values.items()
    ]  # fmt: skip
    changes = [
        Difference(
            row=rows[here].name, against=rows[there].name, auroc=None,
            metrics={"task": {"miou": Estimate(value=-0.1 * here, interval=(-0.3, 0.0))}},
            paired={"outside_patch": {"miou": PairedTest(mean=-0.01 * (here + there), p=0.5, pairs=2)}},
        )
        for here, there in ((1, 0), (2, 0), (2, 1))
    ]  # fmt: skip
    near = PictureGap(psnr_db=44.0, worst=3, outside_rms=0.0, outside_worst=0, outside_px=0)
    shot = SampleGap(index=0, view="left", visible_px=9, distance_m=20, incidence_deg=3, gaps={"transport": near})
    gap = GapReport(
        dataset="", twin="", split="test", patch="", renderer="", quality="", samples=(shot,), model=plan.model,
        effect={"clean": {"miou": 0.7}, "transport": {"miou": 0.48}, "rendered": {"miou": 0.5}},
    )  # fmt: skip
    report = EvaluateReport(out=root, facts={}, rows=tuple(rows), together=(), differences=tuple(changes))
    attack = {"weights_sha256": "ab", "steps_done": 300, "seconds": 90.0}
    write_alone(root / "evaluation/results.json", dump_json(report.as_json()))
    write_alone(root / "gap/gap.json", dump_json(gap.as_json()))
    write_alone(root / plan.name / "attack.json", dump_json(attack))


def test_figures_are_gathered_and_what_is_whole_is_only_read(tmp_path: Path) -> None:
    plan, told, ran = of("semseg")[0], [], []  # type: ignore[var-annotated]
    problems = [GearError("gear collect: no space left")]

    def gear(arguments: Sequence[str]) -> None:
        ran.append(arguments[0])
        if len(ran) == 4 and problems:
            raise problems.pop()
        write_results(tmp_path, plan)

    with pytest.raises(GearError, match="no space left"):
        make_patch(plan, tmp_path, gear, told.append)
    assert told == ["collect train", "collect val", "attack"] and not (tmp_path / EFFECT).exists()
    found = make_patch(plan, tmp_path, gear, told.append)
    assert ran[4:] == ["collect", "collect", "attack", "collect", "collect", "collect", "evaluate", "gap"]
    change = {"value": -0.2, "low": -0.3, "high": 0.0}
    assert found["metric"] == {
        "figure": "miou", "none": 0.7, "random": 0.68, "patched": 0.5, "patched_minus_random": change
    }  # fmt: skip
    assert found["outside"] == {"figure": "outside_patch.miou", "mean": -0.03, "p": 0.5, "pairs": 2}
    assert found["effect"]["digital"] == pytest.approx(-0.22) and found["effect"]["rendered"] == pytest.approx(-0.2)
    assert found["effect"]["share"] == pytest.approx(0.2 / 0.22) and found["psnr_db"] == 44
    assert found["minutes"]["attack"] == 1.5 and found["pictures_with_patch"] == 1
    ran.clear()
    assert make_patch(plan, tmp_path, gear, told.append) == found and not ran
    make_patch(replace(plan, steps=20), tmp_path, gear, told.append)
    assert ran, "another recipe is not taken for this one"


@pytest.fixture
def tiny_models(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    module = types.ModuleType("tiny_models")
    module.gear_models = hookimpl(lambda: [tiny_segmenter], specname="gear_models")  # type: ignore[attr-defined]
    sys.modules["tiny_models"] = module
    found = discover([EntryPoint(name="tiny", value="tiny_models", group="gear")])
    monkeypatch.setattr(building, "catalogue", lambda: found)
    yield
    sys.modules.pop("tiny_models")


def in_this_process(ran: list[str], stop_at: str = "") -> Callable[[Sequence[str]], None]:
    def run(arguments: Sequence[str]) -> None:
        ran.append(arguments[0])
        if arguments[0] == stop_at or main(list(arguments)):
            raise GearError(f"gear {arguments[0]}: stopped")

    return run


def made_at(root: Path, patch: str) -> list[int]:
    pictures = [*root.glob("*/leftImg8bit/**/*.png"), root / patch / "patch_0.png"]
    assert len(pictures) == 2 + 1 + 3 * 4 + 1
    return [path.stat().st_mtime_ns for path in sorted(pictures)]


@pytest.mark.slow
def test_a_patch_is_made_measured_taken_up_again_and_installed(
    tiny_models: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = PatchPlan(
        task="semseg", model="tiny_segmenter", town=str(TINY_TOWN), scene="board", number=3, steps=3, settings=TINY,
        samples={"train": 2, "val": 1, "test": 4}, attack_settings=("height_px=12", "width_px=24", "batch=1"),
    )  # fmt: skip
    root, ran, told = tmp_path / plan.place, [], []
    assert plan.name == "tiny_segmenter-tiny-board"
    with pytest.raises(GearError, match="stopped"):
        make_patch(plan, root, in_this_process(ran, stop_at="gap"), told.append)
    assert not (root / EFFECT).exists() and told[-1] == "evaluate"
    stamps = made_at(root, plan.name)
    found = make_patch(plan, root, in_this_process(ran), told.append)
    assert told[-1] == "gap" and made_at(root, plan.name) == stamps, "pictures and patches are made once"

    results = json.loads((root / "evaluation/results.json").read_text())
    none, random, patched = results["rows"]
    assert (none["dataset"]["patch"], random["dataset"]["patch"]) == ("none", "random")
    assert found["metric"]["none"] == none["metrics"]["task"]["miou"]["value"]
    assert found["metric"]["patched"] == patched["metrics"]["task"]["miou"]["value"]
    here, there = ([s["metrics"]["outside_patch"]["miou"] for s in row["per_sample"]] for row in (patched, random))
    assert found["outside"]["mean"] == pytest.approx(sum(a - b for a, b in zip(here, there, strict=True)) / 4)
    assert found["outside"]["pairs"] == 4 and found["outside"]["p"] in [n / 16 for n in range(2, 17)]
    assert found["effect"]["rendered"] == pytest.approx(found["metric"]["patched"] - found["metric"]["none"])
    assert found["psnr_db"] > 40 and found["steps"] == 3 and 0 <= found["minutes"]["attack"] <= found["minutes"]["all"]
    assert "tiny-board" in table([found])

    ran.clear()
    assert make_patch(plan, root, in_this_process(ran), told.append) == found and not ran, "what is whole is only read"

    target = install(root / plan.name, found, tmp_path / "package/patches")
    assert sorted(path.name for path in target.iterdir()) == ["attack.json", "effect.json", "patch_0.png"]
    assert json.loads((target / "effect.json").read_text()) == found
    assert str(tmp_path) not in (target / "effect.json").read_text()
    monkeypatch.setattr("gear.networks.shipped.shipped_folders", lambda: (tmp_path / "package",))
    installed = resolve_patch(plan.name, surfaces=1, seed=0)
    assert installed.label == patched["dataset"]["patch"], "gear collect --patch NAME shows what was measured"

    again = measure_again(plan, tmp_path / "again", in_this_process(ran), told.append, tmp_path / "package/patches")
    assert ran == [*["collect"] * 3, "evaluate", "gap"] and {name: again[name] for name in found} == found
    figures = ("pictures_with_patch", "metric", "outside", "effect", "psnr_db")
    assert again["again"] == {
        "weights_sha256": results["model"]["weights_sha256"], "samples": 4, "seed": 42_003,
        **{name: found[name] for name in figures},
    }, "by the same weights the same"  # fmt: skip
    assert json.loads((target / "effect.json").read_text()) == again


def test_a_damaged_effect_is_an_error_before_anything_is_measured(tmp_path: Path) -> None:
    plan = PatchPlan(task="semseg", model="tiny_segmenter", town=str(TINY_TOWN), scene="board", number=3, steps=3)
    path = tmp_path / "patches" / plan.name / EFFECT
    path.parent.mkdir(parents=True)
    path.write_text("[]")
    ran: list[Any] = []
    with pytest.raises(
        GearError, match=r"effect\.json: does not hold the measured effect of a patch; make the patch again"
    ):
        measure_again(plan, tmp_path / "run", in_this_process(ran), ran.append, tmp_path / "patches")
    assert not ran
