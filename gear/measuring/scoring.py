"""Computes the metrics of predictions and stores the results, one sample after another.

The last file of a sample is its stored result, a JSON file that marks the sample as finished.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote

import cv2
import numpy as np

from gear.contracts.evaluation import KeepsPredictions, Maskable
from gear.contracts.tasks import Sample
from gear.dataset.checks.output_checks import check_encoded
from gear.dataset.files import explained, inside, sha256, write_whole
from gear.dataset.json_text import dump_json
from gear.dataset.reading import Dataset
from gear.measuring.guarded_model import TimedPrediction, plugin_error
from gear.measuring.metric_json import known_json
from gear.measuring.object_report import OBJECTS, ObjectEvaluator
from gear.measuring.patch_area import MASK_METRICS, mask_metrics, patch_masks, widened
from gear.measuring.reports import OUTSIDE_PATCH, Report, reports_of
from gear.measuring.statistics import AnyEvaluator
from gear.plugins.catalogue import PluginEntry
from gear.plugins.manager import DISTRIBUTION
from gear.plugins.stored_evaluations import DEFENDED, PREDICTIONS, check_files, read_result
from gear.plugins.text import one_line
from gear.values.errors import DatasetError, GearError
from gear.values.frames import UInt8Image
from gear.values.picture_objects import PictureOutcomes
from gear.values.serial import Json, to_json

DEFENDED_WIDTH_PX, DEFENDED_QUALITY = 640, 85
"""Largest width in pixels and WebP quality of the stored pictures that a defense returns."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SampleResult:
    """The stored result of one finished sample.

    Attributes:
        index: index of the sample in the split.
        metrics: metrics of this sample by name, for each report (a group of metrics).
        parts: evaluators that hold only this sample, by name of the report.
        cost: computing times `model_s` and `defense_s` in seconds.
        score: the defense's confidence in 0..1 that the sample is attacked; None if there is none.
        mask: agreement of the defense's mask with the patch, by metric; None without a mask.
        facts: JSON that the task needs to read the prediction from its files.
        sha256: hashes of the prediction's files, by name.
        defended: hashes of the stored pictures that the defense returned, by path; empty without a defense.
    """

    index: int
    metrics: Mapping[str, Mapping[str, float]]
    parts: Mapping[str, AnyEvaluator]
    cost: Mapping[str, float]
    score: float | None
    mask: Mapping[str, float] | None
    facts: Json
    sha256: Mapping[str, str]
    defended: Mapping[str, str] = field(default_factory=dict)

    def as_json(self) -> Json:
        """The content of the JSON file that marks the sample as finished: the fields by name, without `parts`, and with
        the `objects` of tasks with objects.
        """
        return {
            "index": self.index,
            "metrics": {name: known_json(one) for name, one in self.metrics.items()},
            **self.cost,
            "score": self.score,
            "mask": None if self.mask is None else known_json(self.mask),
            "facts": self.facts,
            "sha256": dict(self.sha256),
            **({DEFENDED: dict(self.defended)} if self.defended else {}),
            **({} if self.outcomes is None else {"objects": to_json(self.outcomes)}),
        }

    @property
    def outcomes(self) -> PictureOutcomes | None:
        """The objects of the sample with their states, and its detections; None for tasks without objects."""
        part = self.parts.get(OBJECTS)
        return part.pictures[0] if isinstance(part, ObjectEvaluator) else None


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class UnsavedResult:
    """The result of one sample whose files are not written yet.

    Attributes:
        result: the stored result of the sample.
        files: bytes of the files, by path relative to the dataset's folder in the evaluation.
    """

    result: SampleResult
    files: Mapping[str, bytes]


class Scorer:
    """Computes the metrics of a dataset's samples and stores the results; several threads may use it."""

    def __init__(
        self, dataset: Dataset[Any], root: Path, folder: str, reports: tuple[str, ...], model: PluginEntry
    ) -> None:
        """Prepares the scores of one dataset; nothing is written.

        Args:
            dataset: the evaluated dataset.
            root: folder of the evaluation.
            folder: name of this dataset's folder in the folder of the evaluation.
            reports: names of the requested reports.
            model: plugin of the model that predicts.
        """
        self._dataset, self._root, self._folder, self._model = dataset, root, folder, model
        self._task = dataset.task
        self._keeper = self._task if isinstance(self._task, KeepsPredictions) else None
        self.reports: dict[str, Report] = reports_of(reports, dataset)

    def finished(self) -> set[int]:
        """The indices of the samples that an earlier run finished; they are not predicted again."""
        folder = inside(self._root, f"{self._folder}/samples")
        if self._keeper is None or not folder.is_dir():
            return set()
        return {int(p.stem) for p in folder.glob("*.json") if p.stem.isdecimal() and int(p.stem) < len(self._dataset)}

    def score(self, index: int, sample: Sample, timed: TimedPrediction) -> UnsavedResult:
        """Computes the metrics of a prediction and encodes it as files, which are not written yet.

        Args:
            index: index of the sample.
            sample: the sample with its ground truth.
            timed: the prediction, with the outputs of the defense and the computing time.

        Returns:
            The result of the sample, and the bytes of its files.
        """
        with self._blamed(index):
            metrics, parts = self._measure(sample, timed.prediction)
            encoded = self._keeper and check_encoded(
                self._keeper.encode_prediction(sample, timed.prediction, self._dataset.plan.info), "encode_prediction"
            )
        files = encoded.files if encoded else {}
        defended = {} if timed.defended is None else defended_files(index, timed.defended)
        result = SampleResult(
            index=index,
            metrics=metrics,
            parts=parts,
            cost={"model_s": timed.model_s, "defense_s": timed.defense_s},
            score=timed.score,
            mask=None if timed.mask is None else mask_metrics(sample, timed.mask),
            facts=encoded.facts if encoded else None,
            sha256={name: sha256(data) for name, data in files.items()},
            defended={name: sha256(data) for name, data in defended.items()},
        )
        predicted = {f"{PREDICTIONS}/{name}": data for name, data in files.items()}
        return UnsavedResult(result=result, files=predicted | defended)

    def write(self, unsaved: UnsavedResult) -> SampleResult:
        """Writes the files of a prediction and, last, the stored result, which marks the sample as finished.

        Args:
            unsaved: the result of a sample and the bytes of its files by path.

        Returns:
            The result, as it is stored.
        """
        result = unsaved.result
        for relative, data in unsaved.files.items():
            write_whole(self._root, f"{self._folder}/{relative}", data)
        write_whole(self._root, f"{self._folder}/samples/{result.index:06d}.json", dump_json(result.as_json()))
        return result

    def score_new(self, index: int, sample: Sample, timed: TimedPrediction) -> SampleResult:
        """Computes the metrics of a new prediction and writes its files.

        Args:
            index: index of the sample.
            sample: the sample with its ground truth.
            timed: the prediction, with the outputs of the defense and the computing time.
        """
        return self.write(self.score(index, sample, timed))

    def rescore_stored(self, index: int) -> SampleResult | DatasetError:
        """Reads the stored prediction of an earlier run and computes its metrics.

        Args:
            index: index of the sample.

        Returns:
            The sample's result, or the error if its stored result or its files cannot be read.

        Raises:
            DatasetError: the sample itself cannot be read.
        """
        assert self._keeper is not None
        path = inside(self._root, f"{self._folder}/samples/{index:06d}.json")
        sample = self._dataset[index]
        folder = inside(self._root, f"{self._folder}/{PREDICTIONS}")
        try:
            there = _checked_result(path)
            check_files(folder, there["sha256"])
            check_files(inside(self._root, self._folder), there[DEFENDED])
            with explained(path):
                prediction = self._keeper.decode_prediction(folder, sample, there["facts"], self._dataset.plan.info)
            metrics, parts = self._measure(sample, prediction)  # which it could when it was written
        except DatasetError as error:
            return DatasetError(error.path, error.problem.partition(";")[0])
        except (ValueError, KeyError, TypeError) as error:
            return DatasetError(path, f"cannot be read again ({one_line(error)})")
        return SampleResult(
            index=index,
            metrics=metrics,
            parts=parts,
            cost={"model_s": there["model_s"], "defense_s": there["defense_s"]},
            score=there["score"],
            mask=None if there["mask"] is None else _with_nan(there["mask"]),
            facts=there["facts"],
            sha256=there["sha256"],
            defended=there[DEFENDED],
        )

    def prediction(self, result: SampleResult, sample: Sample) -> Any:
        """Reads the stored prediction of a finished sample; None for a task that stores no predictions.

        Args:
            result: stored result of the sample.
            sample: the sample that the prediction is for.
        """
        if self._keeper is None:
            return None
        folder = inside(self._root, f"{self._folder}/{PREDICTIONS}")
        return self._keeper.decode_prediction(folder, sample, result.facts, self._dataset.plan.info)

    def finish(self, results: list[SampleResult]) -> None:
        """Writes the result files that cover the whole split, for tasks whose format has such files.

        Args:
            results: results of all samples, in order.
        """
        if self._keeper is None:
            return
        rows = [(self._dataset.sidecar(result.index).record, result.facts) for result in results]
        for relative, data in self._keeper.finalise_predictions(rows, self._dataset.plan.info).items():
            write_whole(self._root, f"{self._folder}/{PREDICTIONS}/{relative}", data)

    def _measure(self, sample: Sample, prediction: Any) -> tuple[dict[str, dict[str, float]], dict[str, AnyEvaluator]]:
        metrics: dict[str, dict[str, float]] = {}
        parts: dict[str, AnyEvaluator] = {}
        for name, report in self.reports.items():
            seen = sample
            if name == OUTSIDE_PATCH:
                assert isinstance(self._task, Maskable)
                seen = self._task.without(sample, widened(patch_masks(sample)))
            with report.blamed("update"):
                parts[name] = report.make()
                metrics[name] = report.checked(parts[name].update(seen, prediction), "update")
        return metrics, parts

    @contextmanager
    def _blamed(self, index: int) -> Iterator[None]:
        """Names the model's plugin, or the weights of one of gear's models, when a prediction cannot be scored.

        `gear.plugins.build.blamed` redirects stdout, which threads must not share.
        """
        try:
            yield
        except GearError:
            raise
        except Exception as error:
            if self._model.owner.package != DISTRIBUTION:
                raise plugin_error(self._model, f"prediction of sample {index}", one_line(error)) from error
            if isinstance(error, ValueError):
                what = f"the prediction of {self._model.spec.name} for sample {index}"
                raise GearError(f"cannot score {what} ({one_line(error)}); check its weights") from error
            raise


def _checked_result(path: Path) -> dict[str, Any]:
    """The stored result of a sample, as JSON with checked types and the metrics of masks that gear computes.

    Raises:
        DatasetError: the file is not a result that gear wrote.
    """
    stored = read_result(path)
    if stored["mask"] is not None and stored["mask"].keys() != set(MASK_METRICS):
        raise DatasetError(path, "is not the stored result of a sample (mask: has other metrics)")
    return stored


def defended_files(index: int, views: Mapping[str, UInt8Image]) -> dict[str, bytes]:
    """Encodes the pictures that a defense returned, as small WebP files.

    Args:
        index: index of the sample.
        views: (H, W, 3) uint8 RGB by camera.

    Returns:
        Bytes by path relative to the dataset's folder in the evaluation.
    """
    files = {}
    for camera, pixels in views.items():
        height, width = pixels.shape[:2]
        small = np.ascontiguousarray(pixels)
        if width > DEFENDED_WIDTH_PX:
            size = (DEFENDED_WIDTH_PX, max(1, round(height * DEFENDED_WIDTH_PX / width)))
            small = np.asarray(cv2.resize(small, size, interpolation=cv2.INTER_AREA), np.uint8)
        done, data = cv2.imencode(".webp", small[..., ::-1], [cv2.IMWRITE_WEBP_QUALITY, DEFENDED_QUALITY])
        if done:
            files[f"{DEFENDED}/{index:06d}_{quote(camera, safe='')}.webp"] = data.tobytes()
    return files


def _with_nan(metrics: Mapping[str, float | None]) -> dict[str, float]:
    return {name: float("nan") if value is None else value for name, value in metrics.items()}
