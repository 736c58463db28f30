"""The contract of tasks (what every task plugin promises), as tests.

Subclass it in your plugin's tests, set `spec`, `options` and `headline`, and override `spoil`:

    class TestMyTask(TaskContract):
        spec = my_task
        options = {"width_px": 320, "height_px": 160}
        headline = "miou"

        def spoil(self, prediction):
            return np.roll(prediction, 20, axis=1)

Frames come from `gear.testing.synthetic`, so no renderer is needed.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Any, ClassVar

import numpy as np

from gear.contracts.evaluation import Directed, KeepsPredictions, Maskable, Reports, WithObjects
from gear.contracts.specs import TaskSpec
from gear.contracts.tasks import Encoded, ExtendsIndexes, Sample, Sidecar, SplitInfo, Task
from gear.metrics.object_matching import outcomes
from gear.metrics.patch_distance import PatchArea
from gear.testing.compare import difference, freeze
from gear.testing.spec_checks import check_spec
from gear.testing.synthetic import synthetic_frame
from gear.values.frames import Frame
from gear.values.geometry import RigidTransform
from gear.values.scene import SceneRecord
from gear.values.serial import from_json, to_json

INFO = SplitInfo(town="town10", scene="billboard01", split="val", seed=131, patch_label="none")
WORLD_FROM_EGO = RigidTransform.from_yaw("world", "ego", (12.0, -34.0, 0.0), 0.7)


class TaskContract:
    """The promises of a task plugin, as tests. A plugin's test file subclasses it and sets `spec`.

    Attributes:
        spec: the task's spec.
        options: options of the task's config, small enough for quick tests.
        headline: name of the metric by which predictions are compared.
        perfect: value of that metric for a perfect prediction.
        repeats: number of times that each sample is added to the evaluator before the metric is read.
        undirected: names of the metrics without a better direction, `<report>.<metric>` for those of reports.
    """

    spec: ClassVar[TaskSpec[Any]]
    options: ClassVar[Mapping[str, Any]] = {}
    headline: ClassVar[str]
    perfect: ClassVar[float] = 1.0
    repeats: ClassVar[int] = 2
    undirected: ClassVar[frozenset[str]] = frozenset()

    def spoil(self, prediction: Any) -> Any:
        """A prediction that is clearly worse, made from a good prediction; subclasses define it.

        Args:
            prediction: a prediction in the task's form; it must not be changed.
        """
        raise NotImplementedError("say how to spoil a prediction of this task")

    def task(self) -> Task[Any, Any]:
        """Builds a new task from the spec and the options."""
        return self.spec.build(self.spec.config(**self.options))

    def frame(self, index: int = 0) -> tuple[Frame, SceneRecord]:
        """A synthetic street, rendered for the task's camera rig, with its record.

        Args:
            index: index of the sample; it changes the positions of objects.
        """
        return synthetic_frame(self.task().rig(), index=index, seed=5, world_from_ego=WORLD_FROM_EGO)

    def sample(self, index: int = 0) -> Any:
        """The task's sample, with ground truth, of a synthetic frame.

        Args:
            index: index of the sample; it changes the positions of objects.
        """
        return self.task().ground_truth(*self.frame(index))

    def sidecar(self, sample: Sample, encoded: Encoded) -> Sidecar:
        """The metadata of a sample (sidecar) after a round trip through JSON.

        Args:
            sample: the sample.
            encoded: the result of the task's `encode` for it.
        """
        text = json.dumps([to_json(sample.record), to_json(sample.surfaces), encoded.facts], allow_nan=False)
        record, surfaces, facts = json.loads(text)
        truths = tuple(from_json(type(old), new) for old, new in zip(sample.surfaces, surfaces, strict=True))
        return Sidecar(record=from_json(SceneRecord, record), surfaces=truths, facts=facts, files={})

    def write(self, root: Path, indices: Sequence[int] = (0, 1)) -> list[Sidecar]:
        """Writes a small split to disk as `gear collect` does, and returns the samples' metadata (sidecars).

        Args:
            root: root folder of the new dataset.
            indices: indices of the samples.
        """
        task, sidecars = self.task(), []
        for index in indices:
            sample = self.sample(index)
            encoded = task.encode(sample, INFO)
            sidecars.append(self.sidecar(sample, encoded))
            _put(root, encoded.files)
        _put(root, task.finalise(sidecars, INFO))
        return sidecars

    def test_spec_says_what_it_is(self) -> None:
        """The spec has a name, a summary, a layout and a config with defaults."""
        spec = self.spec
        check_spec("task", spec, self.options)
        assert spec.layout
        assert spec.config() == spec.config(), "every option needs a default"

    def test_rig_has_the_views_of_the_spec(self) -> None:
        """The task's rig has exactly the cameras that the spec names as views, and is the same for every new task."""
        rig = self.task().rig()
        assert tuple(camera.name for camera in rig.cameras) == self.spec.views
        assert rig == self.task().rig()

    def test_sample_has_images_and_surfaces(self) -> None:
        """A sample has the rendered picture and the ground truth of every patch surface for every view."""
        frame, record = self.frame()
        sample = self.task().ground_truth(frame, record)
        assert sample.record == record
        assert set(sample.images) == set(self.spec.views)
        for name, image in sample.images.items():
            camera = record.camera(name)
            assert image.shape == (camera.height_px, camera.width_px, 3)
            assert image.dtype == np.uint8
            assert not difference(image, frame.views[name].rgb)
        expected = [(camera.name, surface.name) for camera in record.cameras for surface in record.surfaces]
        assert [(truth.camera, truth.name) for truth in sample.surfaces] == expected

    def test_ground_truth_leaves_the_frame_alone_and_repeats(self) -> None:
        """`ground_truth` gives the same sample for the same frame; the frame may be read-only and does not change."""
        frame, record = freeze(self.frame())
        untouched, _ = self.frame()
        first = self.task().ground_truth(frame, record)
        second = self.task().ground_truth(frame, record)
        assert not difference(first, second)
        assert not difference(frame.views, untouched.views)

    def test_encode_is_pure(self) -> None:
        """`encode` gives the same bytes for the same sample and does not change the sample."""
        sample = freeze(self.sample())
        first, second = self.task().encode(sample, INFO), self.task().encode(sample, INFO)
        assert first.files == second.files
        assert first.facts == second.facts
        assert not difference(sample, self.sample())

    def test_facts_are_json(self) -> None:
        """The metadata `facts` of an encoded sample is unchanged by a round trip through JSON."""
        facts = self.task().encode(self.sample(), INFO).facts
        assert json.loads(json.dumps(facts, allow_nan=False)) == facts

    def test_paths_stay_inside_and_apart(self, tmp_path: Path) -> None:
        """No file is outside of the dataset's root or in its folder `gear`, and no file is written twice."""
        task, sidecars = self.task(), self.write(tmp_path)
        samples = [set(task.encode(self.sample(index), INFO).files) for index in (0, 1)]
        indices = set(task.finalise(sidecars, INFO))
        assert not samples[0] & samples[1] and not (samples[0] | samples[1]) & indices
        for name in samples[0] | samples[1] | indices:
            path = PurePosixPath(name)
            assert not path.is_absolute() and ".." not in path.parts and "\\" not in name and str(path) == name
            assert path.parts[0] != "gear", "the dataset room keeps its own files there"

    def test_splits_share_a_root(self) -> None:
        """Two splits with the same root write different files."""
        task, sample = self.task(), self.sample()
        other = dataclasses.replace(INFO, split="test")
        assert not set(task.encode(sample, INFO).files) & set(task.encode(sample, other).files)

    def test_reading_gives_back_what_was_written(self, tmp_path: Path) -> None:
        """`decode` returns exactly the sample that `encode` wrote."""
        for index, sidecar in enumerate(self.write(tmp_path)):
            read = self.task().decode(tmp_path, sidecar, INFO)
            assert not difference(read, self.sample(index))

    def test_finalise_repeats_and_needs_no_files(self, tmp_path: Path) -> None:
        """The files that `finalise` makes for a split depend only on the samples' metadata (sidecars)."""
        sidecars = freeze(self.write(tmp_path))
        first, second = self.task().finalise(sidecars, INFO), self.task().finalise(sidecars, INFO)
        assert first == second
        assert {name: (tmp_path / name).read_bytes() for name in first} == dict(first)

    def test_extended_index_files_are_those_of_the_whole_split(self, tmp_path: Path) -> None:
        """If the task has `extend`, its files for a split that grew are those that `finalise` makes."""
        task, sidecars = self.task(), freeze(self.write(tmp_path))
        whole = dict(task.finalise(sidecars, INFO))
        if isinstance(task, ExtendsIndexes):
            for start in range(1, len(sidecars) + 1):
                before = task.finalise(sidecars[:start], INFO)
                assert dict(task.extend(before, start, sidecars, INFO)) == whole

    def test_finalise_takes_an_empty_split(self) -> None:
        """`finalise` accepts a split without samples."""
        assert all(isinstance(data, bytes) for data in self.task().finalise([], INFO).values())

    def test_perfect_prediction_is_perfect(self) -> None:
        """The ground truth as a prediction has the perfect value of the headline metric."""
        result = self.evaluate([0, 1])
        assert math.isclose(result[self.headline], self.perfect, abs_tol=1e-9), result

    def test_spoilt_prediction_is_worse(self) -> None:
        """A clearly worse prediction differs from the perfect value of the headline metric."""
        result = self.evaluate([0, 1], spoilt=True)
        assert abs(result[self.headline] - self.perfect) > 1e-3, result

    def test_merged_evaluators_say_the_same(self) -> None:
        """Two merged evaluators of one sample each give the same metrics as one evaluator of both samples."""
        whole = self.evaluate([0, 1])
        parts = [self._gather(self.task().evaluator(), [index]) for index in (0, 1)]
        parts[0].merge(parts[1])
        assert not difference(dict(parts[0].result()), dict(whole))

    def test_an_empty_evaluator_says_nan(self) -> None:
        """An evaluator without samples gives NaN for every metric."""
        result = self.task().evaluator().result()
        assert all(value != value for value in result.values())

    def test_predictions_survive_their_files(self, tmp_path: Path) -> None:
        """Stored predictions are read exactly as they were written, and no file is written twice.

        The test is skipped for tasks that do not store predictions.
        """
        task = self.task()
        if not isinstance(task, KeepsPredictions):
            return
        names: list[str] = []
        rows = []
        for index in (0, 1):
            sample = freeze(self.sample(index))
            prediction = freeze(self.spoil(task.as_prediction(sample)))
            encoded = task.encode_prediction(sample, prediction, INFO)
            assert task.encode_prediction(sample, prediction, INFO).files == encoded.files
            _put(tmp_path, encoded.files)
            facts = json.loads(json.dumps(encoded.facts, allow_nan=False))
            assert not difference(task.decode_prediction(tmp_path, sample, facts, INFO), prediction)
            names += encoded.files
            rows.append((sample.record, facts))
        names += task.finalise_predictions(rows, INFO)
        assert names and len(set(names)) == len(names)
        assert not any(PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts for name in names)

    def test_masked_ground_truth_says_nothing(self) -> None:
        """With all ground truth masked, the headline metric is NaN; with an empty mask, it is perfect.

        The test is skipped for tasks whose ground truth cannot be masked.
        """
        task, sample = self.task(), freeze(self.sample())
        if not isinstance(task, Maskable):
            return
        prediction = task.as_prediction(sample)
        for value in (True, False):
            masks = {name: np.full(image.shape[:2], value) for name, image in sample.images.items()}
            evaluator = task.evaluator()
            for _ in range(self.repeats):
                evaluator.update(task.without(sample, masks), prediction)
            metric = evaluator.result()[self.headline]
            assert math.isnan(metric) if value else math.isclose(metric, self.perfect, abs_tol=1e-9)

    def test_ground_truth_finds_every_object(self) -> None:
        """With the ground truth as the prediction, every object is detected and no detection is a false alarm.

        The test is skipped for tasks without objects.
        """
        task, sample = self.task(), freeze(self.sample())
        if not isinstance(task, WithObjects):
            return
        shown = task.picture_objects(sample, task.as_prediction(sample))
        assert shown.objects and shown.camera in sample.images
        keys = [(thing.object_id, thing.label) for thing in shown.objects]
        assert len(set(keys)) == len(keys)
        seen = outcomes(shown, PatchArea(np.zeros(sample.images[shown.camera].shape[:2], np.bool_)))
        assert {thing.state for thing in seen.objects} == {"found"}
        assert {one.role for one in seen.detections} == {"found"}

    def test_reports_are_evaluators(self) -> None:
        """Evaluators of `reports` accept the task's samples, give no infinite metric, and NaN without samples."""
        task = self.task()
        for name, evaluator in task.reports().items() if isinstance(task, Reports) else ():
            assert all(value != value for value in evaluator.result().values()), name
            assert not any(math.isinf(v) for v in self._gather(evaluator, [0, 1]).result().values()), name

    def test_metrics_get_worse_in_their_direction(self) -> None:
        """Spoilt predictions improve no metric whose evaluator states a direction. The other metrics, such as numbers
        of objects, are those in `undirected`.

        The test is skipped for evaluators that state no directions (protocol `Directed`).
        """
        task = self.task()
        first, second = (
            {"": task.evaluator(), **(task.reports() if isinstance(task, Reports) else {})} for _ in range(2)
        )
        undirected = set()
        for name, evaluator in first.items():
            if not isinstance(evaluator, Directed):
                continue
            good = dict(self._gather(evaluator, [0, 1]).result())
            bad = self._gather(second[name], [0, 1], spoilt=True).result()
            for metric, value in good.items():
                lower = evaluator.lower_is_better(metric)
                if lower is None:
                    undirected.add(f"{name}.{metric}" if name else metric)
                    continue
                assert not (bad[metric] < value if lower else bad[metric] > value), (name, metric, value, bad[metric])
        assert undirected == self.undirected

    def test_preview_shows_pictures(self) -> None:
        """`preview` returns at least one picture; all are (H, W, 3) uint8."""
        sample = freeze(self.sample())
        pictures = self.task().preview(sample)
        assert pictures
        for picture in pictures.values():
            assert picture.dtype == np.uint8 and picture.ndim == 3 and picture.shape[2] == 3

    def evaluate(self, indices: Sequence[int], *, spoilt: bool = False) -> Mapping[str, float]:
        """The metrics of synthetic samples with the ground truth as the prediction, unchanged or made clearly worse.

        Args:
            indices: indices of the samples.
            spoilt: whether the predictions are made clearly worse.
        """
        result: Mapping[str, float] = self._gather(self.task().evaluator(), indices, spoilt=spoilt).result()
        return result

    def _gather(self, evaluator: Any, indices: Sequence[int], *, spoilt: bool = False) -> Any:
        task = self.task()
        for index in indices:
            sample = freeze(self.sample(index))
            prediction = freeze(task.as_prediction(sample))
            for _ in range(self.repeats):
                evaluator.update(sample, self.spoil(prediction) if spoilt else prediction)
        return evaluator


def _put(root: Path, files: Mapping[str, bytes]) -> None:
    for name, data in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
