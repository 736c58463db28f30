"""The contract of models (what every model plugin promises), as tests.

Subclass it in your plugin's tests and set `spec`:

    class TestMyNet(ModelContract):
        spec = my_net
        options = {"pretrained": False}
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor

from gear.contracts.models import BatchPredictor, Model
from gear.contracts.specs import ModelSpec, TaskSpec
from gear.plugins.manager import catalogue
from gear.testing.compare import difference, freeze, share_apart
from gear.testing.model_state import changes, state_of
from gear.testing.spec_checks import check_spec
from gear.testing.synthetic import synthetic_frame
from gear.testing.tiny_networks import as_batch
from gear.values.frames import UInt8Image


class ModelContract:
    """The promises of a model plugin, as tests. A plugin's test file subclasses it and sets `spec`.

    Attributes:
        spec: the model's spec.
        options: options of the model's config with which it needs no weights file.
        task_options: options of the tasks' configs, such as the size of the pictures.
        tolerance: largest allowed difference between the outputs for a picture alone and in a batch, relative to the
            largest output.
    """

    spec: ClassVar[ModelSpec[Any]]
    options: ClassVar[Mapping[str, Any]] = {}
    task_options: ClassVar[Mapping[str, Any]] = {"width_px": 128, "height_px": 64}
    tolerance: ClassVar[float] = 1e-4

    def make(self) -> Model:
        """Builds a new model from the spec and the options; override it if the options depend on the test."""
        return self.spec.build(self.spec.config(**self.options))

    def samples(self, task: str) -> list[Any]:
        """Two samples of a synthetic street with the task's ground truth.

        Args:
            task: name of the task.
        """
        found = catalogue().get("task", task).spec
        assert isinstance(found, TaskSpec)
        builder = found.build(found.config(**self.task_options))
        return [builder.ground_truth(*synthetic_frame(builder.rig(), index=i, seed=5)) for i in range(2)]

    def views(self, sample: Any) -> dict[str, UInt8Image]:
        """The (H, W, 3) uint8 pictures of a sample that the model takes, by camera name.

        Args:
            sample: a sample of one of the model's tasks.
        """
        return {name: sample.images[name] for name in self.spec.views}

    def batch(self, samples: Sequence[Any]) -> dict[str, Tensor]:
        """The pictures of several samples as (B, 3, H, W) tensors by camera name.

        They require gradients if the model declares gradients.

        Args:
            samples: B samples of one task.
        """
        tensors = as_batch([self.views(sample) for sample in samples])
        return {name: tensor.requires_grad_(self.spec.has_gradients) for name, tensor in tensors.items()}

    def test_the_spec_can_be_used(self) -> None:
        """Name, protocol, config and build of the spec are valid; the spec names tasks and views."""
        check_spec("model", self.spec, self.options)
        assert self.spec.tasks and self.spec.views

    def test_the_tasks_show_what_it_looks_at(self) -> None:
        """The model's tasks are installed, and their samples have pictures of the cameras that the model's spec
        names.
        """
        for task in self.spec.tasks:
            assert set(self.spec.views) <= set(self.samples(task)[0].images)

    def test_predict_sees_pictures_alone(self) -> None:
        """`predict` has the single parameter `views`, so ground truth cannot reach the model."""
        parameters = inspect.signature(self.make().predict).parameters
        assert list(parameters) == ["views"]

    def test_predictions_suit_the_evaluators(self) -> None:
        """The evaluator of every task accepts the model's predictions and gives no infinite metric."""
        model = self.make()
        for name in self.spec.tasks:
            found = catalogue().get("task", name).spec
            evaluator = found.build(found.config(**self.task_options)).evaluator()
            for sample in self.samples(name):
                evaluator.update(sample, model.predict(self.views(sample)))
            assert not any(np.isinf(value) for value in evaluator.result().values())

    def test_predict_repeats_and_leaves_everything_alone(self) -> None:
        """`predict` is repeatable, does not depend on earlier calls, and changes neither pictures nor weights."""
        model = self.make()
        one, two = (self.views(sample) for sample in self.samples(self.spec.tasks[0]))
        before = state_of(model)
        first = model.predict(freeze(one))
        model.predict(freeze(two))
        assert not difference(first, model.predict(one), "prediction")
        assert not changes(before, state_of(model))

    def test_many_are_predicted_as_one_by_one(self) -> None:
        """`predict_many` of a `BatchPredictor` gives the same predictions as `predict`, in the order of the samples."""
        model, samples = self.make(), self.samples(self.spec.tasks[0])
        if not isinstance(model, BatchPredictor):
            return
        many = model.predict_many
        views = [freeze(self.views(sample)) for sample in samples]
        alone = [model.predict(one) for one in views]
        for one, prediction in zip(views, alone, strict=True):
            (found,) = many([one])
            assert share_apart(found, prediction, self.tolerance) <= 0.01, "a sample has another prediction than alone"
        first, second = many(views)  # batches may round differently, which may reorder a detector's boxes
        for found, own, other in ((first, *alone), (second, *reversed(alone))):
            apart, swapped = (share_apart(found, one, self.tolerance) for one in (own, other))
            assert apart <= swapped, "predictions are not in the samples' order"

    def test_two_of_the_same_options_are_alike(self) -> None:
        """Two models with the same options give the same prediction."""
        pictures = self.views(self.samples(self.spec.tasks[0])[0])
        assert not difference(self.make().predict(pictures), self.make().predict(pictures), "prediction")

    def test_forward_takes_batches(self) -> None:
        """Every output of `forward` has the batch as first axis and does not depend on other pictures in the batch."""
        model, samples = self.make(), self.samples(self.spec.tasks[0])
        with torch.no_grad():
            both, one = model.forward(self.batch(samples)), model.forward(self.batch(samples[:1]))
        assert both and set(both) == set(one)
        for name, tensor in both.items():
            assert tensor.shape[0] == 2 and one[name].shape == (1, *tensor.shape[1:]), name
            assert bool(torch.isfinite(tensor).all()), name
            scale = float(tensor[0].abs().max()) + 1e-6
            assert float((tensor[:1] - one[name]).abs().max()) <= self.tolerance * scale, f"{name} depends on the batch"

    def test_forward_looks_at_the_picture(self) -> None:
        """`forward` gives different outputs for different pictures."""
        outputs = self.make().forward(self.batch(self.samples(self.spec.tasks[0])))
        assert any(not torch.equal(tensor[0], tensor[1]) for tensor in outputs.values())

    def test_forward_leaves_everything_alone(self) -> None:
        """`forward`, with or without targets, changes neither weights, buffers, modes nor samples."""
        model = self.make()
        before = state_of(model)
        for task in self.spec.tasks:
            samples = self.samples(task)
            for targets in (None, samples):
                model.forward(self.batch(samples), targets)
                assert not changes(before, state_of(model))
            assert not difference(samples, self.samples(task), "samples")

    def test_losses_are_numbers(self) -> None:
        """`forward` with the batch's samples as targets gives finite scalar losses."""
        for task in self.spec.tasks:
            samples = self.samples(task)
            for name, loss in self.make().forward(self.batch(samples), samples).items():
                assert loss.shape == () and bool(torch.isfinite(loss)), name

    def test_gradients_flow_where_declared(self) -> None:
        """Outputs and losses have finite gradients, not all zero, with respect to the pictures of every camera."""
        if not self.spec.has_gradients:
            return
        model, samples = self.make(), self.samples(self.spec.tasks[0])
        for targets in (None, samples):
            pictures = self.batch(samples)
            total = torch.stack(
                [tensor.double().square().sum() for tensor in model.forward(pictures, targets).values()]
            )
            gradients = torch.autograd.grad(total.sum(), list(pictures.values()))
            for name, gradient in zip(pictures, gradients, strict=True):
                assert bool(torch.isfinite(gradient).all()), name
                assert float(gradient.abs().sum()) > 0, f"no gradient reaches the view {name!r}"

    def test_taps_are_there(self) -> None:
        """`taps` has exactly the names in the spec; each tapped layer runs in `forward` and returns a tensor."""
        model = self.make()
        taps = model.taps()
        assert set(taps) == set(self.spec.taps)
        seen: dict[str, bool] = {}
        handles = [
            tap.register_forward_hook(lambda _module, _in, out, name=name: seen.update({name: torch.is_tensor(out)}))
            for name, tap in taps.items()
        ]
        model.forward(self.batch(self.samples(self.spec.tasks[0])[:1]))
        for handle in handles:
            handle.remove()
        assert seen == dict.fromkeys(taps, True)
