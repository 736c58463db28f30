"""A bench with patches that exist already, in place of attacks."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import gear
from gear.networks.shipped import shipped_patches
from gear.values.errors import GearError
from gear.verbs.bench.plan import Plan, Step
from gear.verbs.bench.request import BenchRequest
from gear.verbs.bench.run import prepared as prepared_request
from tests.verbs.bench.conftest import FEW

pytestmark = pytest.mark.usefixtures("plugins")

Written = Callable[..., Path]
Made = Callable[[tuple[tuple[str, str], ...]], Path]

PAPER_DEPTH = "tasks={depth: {models: {ddrnet23_slim_depth: {}}, defenses: {lgs: {}}}}"


def prepared(config: str | Path, out: Path, *settings: str, record: bool = False) -> Plan:
    return prepared_request(BenchRequest(config=config, out=out, settings=settings, record=record))


def steps(plan: Plan, verb: str) -> list[Step]:
    return [step for step in plan.steps() if step.verb == verb]


def test_patches_of_another_bench_are_shown_in_place_of_an_attack(tmp_path: Path, written: Written, made: Made) -> None:
    first = made(FEW)
    again = gear.bench(written(*FEW), out=tmp_path / "again", settings=[f"attack.patches={first}"])
    assert not (tmp_path / "again/patches").exists()
    folder = tmp_path / "again/data/semseg"
    assert {path.name for path in folder.glob("*/*/*")} == {"none", "random", "patch-small"}
    (scene,) = {path.parent.parent.name for path in folder.glob("*/*/none")}
    assert again.facts["existing_patches"] == [f"semseg/small/{scene}"]
    pictures = sorted((first / "data").rglob("patch-small/leftImg8bit/**/*.png"))
    assert pictures
    for path in pictures:
        assert (tmp_path / "again/data" / path.relative_to(first / "data")).read_bytes() == path.read_bytes()
    kept = sorted(first.glob("patches/semseg/small/*/patch_0.png"))
    assert kept and "with the patch against small" in (tmp_path / "again/report.html").read_text()


def test_what_another_bench_lacks_is_attacked(tmp_path: Path, written: Written, made: Made) -> None:
    config = written(*FEW[:-1])  # adaptive: the first bench has only the patch without a defense
    plan = prepared(config, tmp_path / "again", f"attack.patches={made(FEW)}")
    (attack,) = steps(plan, "attack")
    assert attack.arguments["defense"] == "gaussian"
    assert {"train", "val"} <= {step.arguments["split"] for step in steps(plan, "collect")}


def test_a_source_with_too_few_pictures_for_a_scene_is_not_used(tmp_path: Path, written: Written, made: Made) -> None:
    for path in made(FEW).glob("patches/semseg/small/*/patch_0.png"):
        path.unlink()
    plan = prepared(written(*FEW), tmp_path / "again", f"attack.patches={tmp_path / 'out'}")
    assert len(steps(plan, "attack")) == 1


def test_a_source_without_patches_is_refused(tmp_path: Path, written: Written) -> None:
    with pytest.raises(GearError, match=r"attack\.patches: .*holds no patches of a benchmark; name the --out folder"):
        prepared(written(*FEW), tmp_path / "again", f"attack.patches={tmp_path}")


def test_records_need_the_attack_of_their_own_bench(tmp_path: Path, written: Written, made: Made) -> None:
    with pytest.raises(GearError, match=r"attack\.patches: records state what the attack .* leave out --record"):
        prepared(written(*FEW), tmp_path / "again", f"attack.patches={made(FEW)}", record=True)


def test_shipped_patches_are_for_shipped_weights(tmp_path: Path) -> None:
    names = [f"ddrnet23_slim_depth-town10-{scene}" for scene in ("billboard01", "truck")]
    assert all(name in shipped_patches() for name in names)
    places = ("attack.patches=shipped", "adaptive=false", "places={town10: [billboard01, truck]}")
    plan = prepared("paper", tmp_path, *places, PAPER_DEPTH)
    assert not steps(plan, "attack")
    shown = {step.arguments["patch"] for step in steps(plan, "collect")}
    assert shown == {"none", "random", *(str(shipped_patches()[name]) for name in names)}
    other = PAPER_DEPTH.replace("ddrnet23_slim_depth: {}", "ddrnet23_slim_depth: {set: {weights: none}}")
    assert len(steps(prepared("paper", tmp_path, *places, other), "attack")) == 2
