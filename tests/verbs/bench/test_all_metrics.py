"""Every figure by scene, as flat records."""

from __future__ import annotations

from gear.verbs.bench.all_metrics import ALL, COLUMNS, metric_records
from tests.verbs.bench.synthetic import report


def test_every_quantity_by_scene_and_over_all() -> None:
    found = list(metric_records(report()))
    assert all(set(one) <= set(COLUMNS) for one in found)
    assert {one["quantity"] for one in found} == {"value", "change", "mean change", "auroc", "mask", "seconds"}
    assert {one["scene"] for one in found} == {ALL, "town10-board_1", "town10-truck"}

    def the(**wanted: str) -> dict[str, object]:
        (one,) = [one for one in found if all(one.get(key) == value for key, value in wanted.items())]
        return one

    scene = {"defense": "", "scene": "town10-truck", "patch": "patch", "metric": "miou"}
    assert the(quantity="value", **scene)["value"] == 0.4
    change = the(quantity="change", against="random", **scene)
    assert change["value"] is not None and change["low"] is not None
    assert the(quantity="mean change", against="none", **scene)["p"] == 0.001
    auroc = the(defense="detector", scene="town10-truck", patch="patch", quantity="auroc", against="none")
    assert auroc["value"] == 0.8
