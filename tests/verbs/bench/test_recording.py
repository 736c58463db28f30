"""Records of a benchmark: what `gear bench --record` writes, and that nothing of this machine is in it."""

from __future__ import annotations

import csv
import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import pytest

import gear
from gear.cli.main import main
from gear.leaderboard.reading import encoded, read_record
from tests.verbs.bench.conftest import LEARNING

pytestmark = pytest.mark.usefixtures("plugins")


def test_a_record_holds_what_a_check_needs(
    tmp_path: Path, written: Callable[..., Path], made: Callable[..., Path]
) -> None:
    out = made(LEARNING)
    assert main(["bench", str(written(*LEARNING)), "--out", str(out), "--record"]) == 0
    paths = sorted(path.name for path in (out / "records").glob("*.json"))
    assert paths == ["semseg-small+fpda-seed0.json", "semseg-small-seed0.json"]
    guarded, alone = (read_record(out / "records" / name) for name in paths)
    record = guarded.record
    assert guarded.sha256 == hashlib.sha256(encoded(record)).hexdigest(), "read and written again it is the same"
    assert (record.entry.kind, alone.record.entry.kind) == ("defense", "model")
    assert record.entry.defense is not None and record.entry.defense.package == "mujoco-gear"
    assert record.entry.network.weights_sha256 and not record.entry.is_random
    assert record.kinds() == ("none", "random", "patch", "adaptive patch") and len(record.data) == 4
    assert [one.patch for one in record.calibration] == ["none", "patch"]
    assert {one.scene for one in record.patches} == {"tiny-board", "tiny-truck"}, "the scene of calibration, too"
    for one in record.patches:
        for digest in one.sha256:
            data = (out / "records/patches" / f"{digest}.png").read_bytes()
            assert hashlib.sha256(data).hexdigest() == digest
    results = json.loads((out / "evaluations/semseg/small+fpda/results.json").read_text())
    pools = {pool["name"]: pool["metrics"]["task"]["miou"] for pool in results["pools"]}
    for kind, wanted in pools.items():
        figure = record.figure(kind)
        assert figure is not None and (figure.value, figure.low) == (wanted["value"], wanted["low"])
        reference, same = record.figure(kind, is_reference=True), alone.record.figure(kind)
        assert reference == same
    assert record.figure("patch", "auroc") is not None
    values = [note["metrics"]["task"]["miou"] for row in results["rows"] for note in row["per_sample"]]
    assert [sample.value for sample in record.samples] == values and record.sample_metric == "miou"
    assert str(tmp_path) not in encoded(record).decode() and "/tiny" not in encoded(record).decode()
    table = (out / "tables/table1.tex").read_text()
    assert "fpda" in table and "tiny-board" in table and (out / "tables/table2.tex").is_file()
    page = (out / "report.html").read_text()
    assert "Table 1: detection of patches by scene" in page and "gear bench bench.yml; seed 0" in page
    with (out / "metrics.csv").open() as file:
        lines = list(csv.DictReader(file))
    scores = [line for line in lines if line["quantity"] == "auroc" and line["defense"] == "fpda"]
    assert {(line["scene"], line["patch"], line["against"]) for line in scores} >= {("tiny-board", "patch", "none")}
    shown = json.loads((out / "bench.json").read_text())["tasks"]["semseg"]["results"]
    clean, behind = (one["patches"]["none"]["value"]["value"] for one in shown)
    cost = shown[1]["patches"]["none"]["gain"]
    assert cost["value"] == pytest.approx(behind - clean), "against the network without a defense"
    before = {path: path.read_bytes() for path in (out / "records").rglob("*.*")}
    gear.bench(written(*LEARNING), out=out, record=True)
    assert {path: path.read_bytes() for path in (out / "records").rglob("*.*")} == before
    gear.bench(written(*LEARNING), out=out, record="attack")
    assert read_record(out / "records/semseg-small+fpda-seed0.json").record.entry.kind == "attack"
