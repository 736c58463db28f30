"""Records without a benchmark behind them."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import Any

from gear.leaderboard.drive_claims import DriveClaim
from gear.leaderboard.reading import Filed, encoded
from gear.leaderboard.record import (
    AttackFacts,
    Benchmark,
    Data,
    Entry,
    Figure,
    PatchFacts,
    Plugin,
    Record,
    SampleResult,
    digest,
)

SAMPLES = 4
VALUES = {"none": 0.70, "random": 0.68, "patch": 0.60, "adaptive patch": 0.50}
ALONE = {"none": 0.71, "random": 0.68, "patch": 0.30}


def sha(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def plugin(name: str, **changes: Any) -> Plugin:
    facts: dict[str, Any] = {
        "name": name, "package": "mujoco-gear", "version": "0.1", "options": {}, "code_sha256": sha("code"),
    }  # fmt: skip
    return Plugin(**(facts | changes))


def figures(values: dict[str, float], half: float = 0.02) -> tuple[Figure, ...]:
    return tuple(
        Figure(patch=patch, name="miou", value=value, low=value - half, high=value + half, n=SAMPLES)
        for patch, value in values.items()
    )


def benchmark(**changes: Any) -> Benchmark:
    config: dict[str, Any] = {
        "tasks": {"semseg": {"models": {"net": {}}, "defenses": {"guard": {}}, "collect": {}}},
        "places": {"town10": ["billboard01"]}, "weathers": [{"preset": "ClearNoon"}], "samples": {"measure": SAMPLES},
        "collect": {}, "seed": 0,
    }  # fmt: skip
    config |= changes
    return Benchmark(name="small", config=config, sha256=digest(config))


def record(values: dict[str, float] = VALUES, **changes: Any) -> Record:
    """A record of a defense; `changes` replace fields of the record, of its entry (`entry=`) or attack (`attack=`)."""
    entry: dict[str, Any] = {
        "kind": "defense", "task": "semseg", "metric": "miou", "lower_is_better": False,
        "network": plugin("net", weights_sha256=sha("weights")), "defense": plugin("guard"),
        "gradient": "differentiable", "is_random": False,
    } | changes.pop("entry", {})  # fmt: skip
    attack: dict[str, Any] = {"plugin": plugin("eot"), "knowledge": "white-box", "steps": 100, "queries": 0}
    attack |= changes.pop("attack", {})
    data = tuple(
        Data(
            scene="town10-billboard01", weather="ClearNoon", patch=patch, samples=SAMPLES, content_key=sha(patch),
            twin_key=sha("twin"), manifest_sha256=sha("manifest" + patch),
        )
        for patch in values
    )  # fmt: skip
    fields: dict[str, Any] = {
        "benchmark": benchmark(), "entry": Entry(**entry), "attack": AttackFacts(**attack),
        "environment": {"machine": "x86_64"}, "data": data, "calibration": (),
        "patches": (PatchFacts(scene="town10-billboard01", target="net+guard", sha256=(sha("patch"),), gain=1.0),),
        "results": figures(values), "reference": figures(ALONE), "sample_metric": "miou",
        "samples": tuple(
            SampleResult(data=number, index=index, sha256=sha(f"{number} {index}"), value=0.5, score=None)
            for number in range(len(data)) for index in range(SAMPLES)
        ),
        "cost_s": {"model": 0.1, "defense": 0.0},
    }  # fmt: skip
    return Record(**(fields | changes))


def drive(patch: str, seed: int = 0, *, is_crash: bool = False, **changes: Any) -> DriveClaim:
    facts: dict[str, Any] = {
        "scene": "town10-billboard01", "scenario": "stopped_lead", "speed_kmh": 40.0, "seed": seed, "patch": patch,
        "is_free": False, "is_crash": is_crash, "score": 0.5, "log_sha256": sha(f"{patch} {seed}"),
    }  # fmt: skip
    return DriveClaim(**(facts | changes))


def driving(one: Record, crashes: dict[str, int], count: int = 4) -> Record:
    """A record with drives, of which some crash, by kind of patch."""
    drives = [drive(patch, seed, is_crash=seed < most) for patch, most in crashes.items() for seed in range(count)]
    return replace(one, controller=plugin("depth_baseline"), drives=tuple(drives))


def filed(one: Record, name: str = "one.json") -> Filed:
    return Filed(record=one, path=Path(name), sha256=hashlib.sha256(encoded(one)).hexdigest())


def attacking(one: Record, value: float, **attack: Any) -> Record:
    """Another person's attack on the row of a record, under which the network has this value."""
    changed = tuple(replace(f, value=value, low=value, high=value) if f.patch == "patch" else f for f in one.results)
    facts = {"plugin": plugin("theirs", package="their-package"), **attack}
    return replace(one, entry=replace(one.entry, kind="attack"), attack=replace(one.attack, **facts), results=changed)
