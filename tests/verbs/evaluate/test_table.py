"""What the table of an evaluation says beside its metrics."""

from pathlib import Path

from gear.verbs.evaluate.report import Estimate, EvaluateReport, RowReport
from gear.verbs.evaluate.table import FEW_STREETS, table

NAN = float("nan")


def report(metrics: dict[str, Estimate]) -> EvaluateReport:
    row = RowReport(
        name="test-none-0123", dataset=Path("data"), facts={"patch": "none"}, samples=3, made=3, damaged=(),
        metrics={"task": metrics}, cost={"model_s": 0.1, "defense_s": 0.0}, defense={}, per_sample=[],
    )  # fmt: skip
    facts = {"task": {"name": "stereo3d"}, "model": {"name": "odd"}, "defense": None}
    return EvaluateReport(out=Path("out"), facts=facts, rows=(row,), together=(), differences=())


def test_it_says_how_far_perfect_predictions_come_where_that_is_not_all_the_way() -> None:
    metrics = {"car_r11": Estimate(value=0.5), "car_r40": Estimate(value=0.05, ceiling=0.075)}
    lines = table(report(metrics)).splitlines()
    assert lines[-1] == "perfect predictions would score car_r40 0.075 in data"
    assert not any("perfect" in line for line in table(report({"car_r11": Estimate(value=0.5)})).splitlines())


def test_metrics_of_one_beginning_without_any_value_are_named_once() -> None:
    metrics = {
        "car_r40": Estimate(value=0.5), "car_r11": Estimate(value=NAN), "bus_r40": Estimate(value=NAN),
        "van_r11": Estimate(value=NAN), "van_r40": Estimate(value=NAN),
    }  # fmt: skip
    assert table(report(metrics)).splitlines()[-1] == ("nothing to measure for car_r11, bus_r40, van_* in data")


def test_a_ceiling_is_written_where_there_is_one() -> None:
    assert Estimate(value=0.05, ceiling=0.075).as_json() == {"value": 0.05, "low": None, "high": None, "ceiling": 0.075}
    assert "ceiling" not in Estimate(value=0.05).as_json()


def test_an_interval_from_too_few_streets_is_marked_and_noted_once() -> None:
    few = Estimate(value=0.5, interval=(0.4, 0.6), is_from_few=True)
    assert few.as_json() == {"value": 0.5, "low": 0.4, "high": 0.6, "from_few_streets": True}
    assert "from_few_streets" not in Estimate(value=0.5, is_from_few=True).as_json()
    text = table(report({"miou": few, "iiou": few, "known": Estimate(value=0.5, is_from_few=True)}))
    assert text.count("0.500 [0.400, 0.600]*") == 2 and text.count(FEW_STREETS) == 1
    enough = table(report({"miou": Estimate(value=0.5, interval=(0.4, 0.6))}))
    assert "0.500 [0.400, 0.600]" in enough and "*" not in enough
