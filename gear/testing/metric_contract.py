"""The contract of metrics (what every metric plugin promises), as tests.

Subclass it in your plugin's tests and set `spec`:

    class TestMyMetric(MetricContract):
        spec = my_metric
        task_options = {"width_px": 256, "height_px": 128}

Frames come from `gear.testing.synthetic`, so no renderer is needed. For tasks other than gear's own, override `spoil`,
which makes a prediction worse.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from gear.contracts.evaluation import Additive, Maskable, Resampled
from gear.contracts.specs import MetricSpec, TaskSpec
from gear.contracts.tasks import Evaluator, Task
from gear.dataset.checks.output_checks import check_metrics
from gear.plugins.manager import catalogue
from gear.testing.compare import difference, freeze
from gear.testing.spec_checks import check_spec
from gear.testing.synthetic import synthetic_frame

SAMPLES = 3


class MetricContract:
    """The promises of a metric plugin, as tests, for each task that the metric supports.

    Attributes:
        spec: the metric's spec.
        options: options of the metric's config.
        task_options: options of the tasks' configs, such as a size of pictures that is small enough for quick tests.
    """

    spec: ClassVar[MetricSpec[Any]]
    options: ClassVar[Mapping[str, Any]] = {}
    task_options: ClassVar[Mapping[str, Any]] = {"width_px": 256, "height_px": 128}

    def spoil(self, task: str, prediction: Any) -> Any:
        """A clearly worse prediction of the same type, made from a good prediction.

        Label maps are shifted by 20 pixels, depth is doubled, and lists of detections or stereo boxes become empty.

        Args:
            task: name of the task.
            prediction: a prediction in the task's form; it is not changed.
        """
        if task == "semseg":
            return np.roll(prediction, 20, axis=1)
        if task == "depth":
            return prediction * 2
        if task in ("detect2d", "stereo3d"):
            return type(prediction)()
        raise NotImplementedError(f"override spoil: say how a prediction of task {task!r} gets worse")

    def make(self) -> Evaluator[Any, Any]:
        """A new, empty evaluator of the metric."""
        return self.spec.build(self.spec.config(**self.options))

    def task(self, name: str) -> Task[Any, Any]:
        """Builds a task by its name, with `task_options`.

        Args:
            name: name of the task.
        """
        found = catalogue().get("task", name).spec
        assert isinstance(found, TaskSpec)
        return found.build(found.config(**self.task_options))

    def pairs(self, task: str, *, spoilt: bool = False) -> list[tuple[Any, Any]]:
        """Pairs of a sample and a prediction, perfect or clearly worse, of synthetic streets; arrays are read-only.

        Args:
            task: name of the task.
            spoilt: whether the predictions are clearly worse than the ground truth.
        """
        builder, found = self.task(task), []
        for index in range(SAMPLES):
            sample = builder.ground_truth(*synthetic_frame(builder.rig(), index=index, seed=5))
            prediction = builder.as_prediction(sample)
            found.append((freeze(sample), freeze(self.spoil(task, prediction) if spoilt else prediction)))
        return found

    def test_the_spec_can_be_used(self) -> None:
        """Name, summary, protocol, config and tasks of the spec are valid."""
        check_spec("metric", self.spec, self.options)
        known = catalogue().names("task")
        assert all(task in known for task in self.spec.tasks), f"its tasks must be among {', '.join(known)}"

    def test_every_evaluator_is_a_fresh_one(self) -> None:
        """`build` returns a new evaluator each time; evaluators do not share their samples."""
        for task in self.spec.tasks:
            empty = dict(self.make().result())
            self.gathered(self.pairs(task))
            assert self.make() is not self.make()
            assert not difference(dict(self.make().result()), empty)

    def test_metrics_are_numbers_by_name(self) -> None:
        """`update` and `result` return numbers by name; `result` has the main metric and no infinite number."""
        for task in self.spec.tasks:
            evaluator = self.make()
            for sample, prediction in self.pairs(task):
                check_metrics(evaluator.update(sample, prediction), "update")
            result = check_metrics(evaluator.result(), "result")
            assert self.spec.metric in result, f"{self.spec.metric!r} is not among {', '.join(result)}"
            assert not any(math.isinf(value) for value in result.values())

    def test_an_empty_evaluator_gives_nan(self) -> None:
        """Without samples every metric is NaN, and no error is raised."""
        assert all(math.isnan(value) for value in check_metrics(self.make().result(), "result").values())

    def test_a_spoilt_prediction_is_worse(self) -> None:
        """A clearly worse prediction has a worse main metric, in the direction that the spec declares."""
        for task in self.spec.tasks:
            good, bad = (self.gathered(self.pairs(task, spoilt=spoilt)).result() for spoilt in (False, True))
            better, worse = good[self.spec.metric], bad[self.spec.metric]
            assert worse > better if self.spec.lower_is_better else worse < better, (task, better, worse)

    def test_merged_evaluators_equal_the_whole(self) -> None:
        """Merged evaluators of one sample each give the same metrics as one evaluator of all samples."""
        for task in self.spec.tasks:
            pairs = self.pairs(task, spoilt=True)
            whole, merged = self.gathered(pairs), self.make()
            for pair in pairs:
                merged.merge(self.gathered([pair]))
            _assert_close(merged.result(), whole.result())

    def test_samples_and_predictions_are_left_alone(self) -> None:
        """`update` writes neither to the sample nor to the prediction; the same input gives the same output."""
        for task in self.spec.tasks:
            pairs = self.pairs(task, spoilt=True)
            before = copy.deepcopy(pairs)
            first, second = self.gathered(pairs).result(), self.gathered(pairs).result()
            assert not difference(dict(first), dict(second))
            assert not difference(pairs, before)

    def test_resampling_equals_merging(self) -> None:
        """Evaluators with fast resampling give the same metrics as merging single-sample evaluators.

        Fast resampling is `resampled` (protocol `Resampled`), or `totals` with `metrics` (protocol `Additive`).
        """
        for task in self.spec.tasks:
            pairs = self.pairs(task, spoilt=True)
            parts = [self.gathered([pair]) for pair in pairs]
            draws = np.array([[0, 0, 1], [2, 1, 2]], np.int64)
            whole = self.gathered(pairs)
            if isinstance(whole, Resampled):
                found = whole.resampled(draws)
            elif isinstance(whole, Additive):
                sums: dict[str, Any] = {}
                for name in parts[0].totals():
                    each = np.stack([np.asarray(part.totals()[name], np.float64) for part in parts])
                    sums[name] = np.stack([each[row].sum(axis=0) for row in draws])
                found = whole.metrics(sums)
            else:
                continue
            for number, row in enumerate(draws):
                merged = self.make()
                for index in row:
                    merged.merge(parts[index])
                expected = merged.result()
                _assert_close({name: float(values[number]) for name, values in found.items()}, expected)

    def test_masked_ground_truth_is_taken(self) -> None:
        """A sample whose whole ground truth is masked, as the report `outside_patch` may produce, raises no error."""
        for task in self.spec.tasks:
            builder = self.task(task)
            if not isinstance(builder, Maskable):
                continue
            (sample, prediction), *_ = self.pairs(task)
            masks = {name: np.ones(image.shape[:2], np.bool_) for name, image in sample.images.items()}
            check_metrics(self.gathered([(builder.without(sample, masks), prediction)]).result(), "result")

    def gathered(self, pairs: Sequence[tuple[Any, Any]]) -> Any:
        """A new evaluator to which these pairs of sample and prediction were added.

        Args:
            pairs: sample and prediction of each picture.
        """
        evaluator = self.make()
        for sample, prediction in pairs:
            evaluator.update(sample, prediction)
        return evaluator


def _assert_close(found: Mapping[str, float], expected: Mapping[str, float]) -> None:
    """Asserts that metrics are equal up to the rounding of sums in another order; NaN equals NaN."""
    for name, value in found.items():
        assert math.isclose(value, expected[name], rel_tol=1e-9, abs_tol=1e-12) or (
            math.isnan(value) and math.isnan(expected[name])
        ), (name, value, expected[name])
