"""The objectives that attacks maximise: for each task, terms that are computed from a model's outputs or losses.

Every term grows with the harm. For segmentation and depth, pixels that show the patch do not count, because an attack
is measured by its effect on the other pixels. Losses of detectors and stereo networks cover the whole picture, as in
training; there are no labelled objects on billboards.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor
from torch.nn import functional

from gear.contracts.attacks import HarmObjective, Objective, SampleWithObjective, Term
from gear.contracts.models import Model
from gear.formats import rle
from gear.formats.cityscapes import IGNORED_TRAIN_ID, LABELS
from gear.networks.network import as_batch
from gear.plugins.attacks.optimisation.clean_outputs import CleanOutputs
from gear.plugins.attacks.optimisation.frozen_model import frozen
from gear.plugins.attacks.optimisation.model_group import Defended, members_of
from gear.values.errors import GearError

TRAIN_IDS = torch.tensor([label.train_id for label in LABELS if label.id >= 0])
TRAIN_CLASSES = 19

Kind = Literal["semseg", "depth", "losses"]


def default_objective(sample: Any) -> Objective:
    """Returns the objective of an untargeted attack, chosen by the ground truth of `sample`.

    `SemsegObjective` for samples with `label_ids`, `DepthObjective` for samples with `depth_m`, and otherwise
    `LossObjective`, which maximises all losses of the model. A sample that brings its own objective
    (`SampleWithObjective`) decides itself.
    """
    if isinstance(sample, SampleWithObjective):
        return sample.own_objective()
    kind = kind_of(sample)
    if kind == "semseg":
        return SemsegObjective()
    return DepthObjective() if kind == "depth" else LossObjective(signs={})


def kind_of(sample: Any) -> Kind:
    """Returns the kind of objective for a sample: `semseg` for labels, `depth` for a depth map, else `losses`.

    Args:
        sample: a sample of any task.
    """
    if hasattr(sample, "label_ids"):
        return "semseg"
    return "depth" if hasattr(sample, "depth_m") else "losses"


def outside(samples: Sequence[Any], view: str, device: torch.device) -> Tensor:
    """Returns the (B, H, W) bool mask of the pixels in one view that show no patch surface.

    Args:
        samples: the B samples, with pictures of one size.
        view: name of the camera.
        device: device of the mask.
    """
    masks = []
    for sample in samples:
        height, width = sample.images[view].shape[:2]
        free = np.ones((height, width), dtype=np.bool_)
        for surface in sample.surfaces:
            if surface.camera == view and surface.visible_px:
                free &= ~_mask(surface.mask_rle, height, width)
        masks.append(free)
    return torch.from_numpy(np.stack(masks)).to(device)


@dataclass(frozen=True, slots=True, kw_only=True)
class SemsegObjective:
    """Cross-entropy in two terms: over the correctly classified pixels (Y) and over the misclassified pixels (N).

    Y and N are as in Rossolini et al. (2022).

    Attributes:
        gamma: weight of the term over Y; the term over N has the weight 1 - gamma. `dynamic` takes the current share of
            correctly classified pixels.
        source_class, target: label ids. Pixels of the class `source_class` (of all classes if None) are pushed to the
            class `target`. If `target` is None, the attack is untargeted.
    """

    gamma: float | Literal["dynamic"] = "dynamic"
    source_class: int | None = None
    target: int | None = None
    _right: CleanOutputs = field(default_factory=CleanOutputs, init=False, repr=False, compare=False)

    @property
    def needs_clean_output(self) -> bool:
        """Whether `harm` needs the network's output on the picture without the patch: one more pass per sample."""
        return self.target is None and self.gamma != "dynamic"

    def terms(
        self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indices: Sequence[int]
    ) -> Mapping[str, Term]:
        """Returns the terms `correct` (over correctly classified pixels) and `wrong` (over misclassified pixels).

        A term without pixels or with weight 0 is left out. A targeted attack has the single term `target` instead.

        Args:
            model: the attacked network.
            views: (B, 3, H, W) pictures with the patches by camera name, float in 0..1.
            samples: the B samples with their ground truth.
            indices: not used.
        """
        logits, labels, counts = self._outputs(model, views, samples)
        if self.target is not None:
            return self._targeted(logits, labels, counts)
        loss = functional.cross_entropy(logits, labels, ignore_index=IGNORED_TRAIN_ID, reduction="none")
        right = counts & _is_right(logits.detach(), labels)
        wrong = counts & ~right
        if self.gamma == "dynamic":
            gamma = float(right.sum() / counts.sum().clamp_min(1))
        else:
            gamma = self.gamma
        return _split(loss, {"correct": (right, gamma), "wrong": (wrong, 1 - gamma)})

    def harm(self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indices: Sequence[int]) -> Tensor:
        """The harm as one number: the weighted sum of the terms.

        With a fixed `gamma`, the correctly classified pixels are those of the output on the picture without the patch.
        If they were taken from the current output, the value would fall while the attack succeeds, because every pixel
        that becomes wrong leaves this set.

        Args:
            model: the attacked network.
            views: (B, 3, H, W) pictures with the patches by camera name, float in 0..1.
            samples: the B samples with their ground truth.
            indices: indices of these samples in the dataset.
        """
        if not self.needs_clean_output:
            terms = [one.weight * one.value for one in self.terms(model, views, samples, indices).values()]
            return torch.stack(terms).sum() if terms else torch.zeros(())
        assert self.gamma != "dynamic"
        logits, labels, counts = self._outputs(model, views, samples)

        def rightly_said(sample: Any) -> Tensor:
            clean = _logits(model, as_batch([sample.images], list(views)))
            return _is_right(clean, train_labels([sample], clean.shape[1]).to(clean.device))[0]

        right = counts & self._right.of(model, samples, indices, rightly_said).to(logits.device)
        loss = functional.cross_entropy(logits, labels, ignore_index=IGNORED_TRAIN_ID, reduction="none")
        return self.gamma * _mean(loss, right) + (1 - self.gamma) * _mean(loss, counts & ~right)

    def _outputs(
        self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any]
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Logits (B, C, H, W), target labels (B, H, W), and the (B, H, W) bool mask of the pixels that count."""
        logits = _logits(model, views)
        labels = train_labels(samples, logits.shape[1]).to(logits.device)
        return logits, labels, outside(samples, next(iter(views)), logits.device) & (labels != IGNORED_TRAIN_ID)

    def _targeted(self, logits: Tensor, labels: Tensor, counts: Tensor) -> Mapping[str, Term]:
        assert self.target is not None
        classes = logits.shape[1]
        wanted = class_of(self.target, classes)
        if self.source_class is not None:
            counts = counts & (labels == class_of(self.source_class, classes))
        loss = functional.cross_entropy(logits, torch.full_like(labels, wanted), reduction="none")
        return {"target": Term(value=-_mean(loss, counts))}


class DepthObjective:
    """Smooth L1 distance from the network's own output on the picture without the patch, in two terms by size of error.

    Args:
        gamma: weight of the term of small errors (at most `split_m`); the term of large errors has the weight 1 -
            gamma.
        split_m: limit between small and large errors, metres.
        direction: `any` error, or only depth that is `farther` or `nearer` than the output without the patch. For
            `farther` and `nearer` there is one term, the mean change of the logarithm of depth.
    """

    needs_clean_output = True

    def __init__(
        self, *, gamma: float = 0.8, split_m: float = 0.5, direction: Literal["any", "farther", "nearer"] = "any"
    ) -> None:
        self._gamma, self._split_m, self._direction = gamma, split_m, direction
        self._clean = CleanOutputs()

    def terms(
        self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indices: Sequence[int]
    ) -> Mapping[str, Term]:
        """Returns the terms `small` (errors up to `split_m`) and `large` (larger errors).

        A term without pixels or with weight 0 is left out. With a direction there is a single term, `farther` or
        `nearer`.

        Args:
            model: the attacked network.
            views: (B, 3, H, W) pictures with the patches by camera name, float in 0..1.
            samples: the B samples, whose pictures without patches the network sees once.
            indices: indices of these samples in the dataset.
        """
        depth_m, clean, free = self._outputs(model, views, samples, indices)
        if self._direction != "any":
            return {self._direction: Term(value=self._pushed(depth_m, clean, free))}
        error = functional.smooth_l1_loss(depth_m, clean, reduction="none")
        small = free & ((depth_m.detach() - clean).abs_() <= self._split_m)
        return _split(error, {"small": (small, self._gamma), "large": (free & ~small, 1 - self._gamma)})

    def harm(self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indices: Sequence[int]) -> Tensor:
        """The harm as one number: the mean error over all pixels, small and large errors together.

        A weighted sum of two means would fall when an error grows past `split_m`. One pixel with a large error would
        also count for more than all pixels with small errors.

        Args:
            model: the attacked network.
            views: (B, 3, H, W) pictures with the patches by camera name, float in 0..1.
            samples: the B samples with their ground truth.
            indices: indices of these samples in the dataset.
        """
        depth_m, clean, free = self._outputs(model, views, samples, indices)
        if self._direction != "any":
            return self._pushed(depth_m, clean, free)
        return _mean(functional.smooth_l1_loss(depth_m, clean, reduction="none"), free)

    def _outputs(
        self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indices: Sequence[int]
    ) -> tuple[Tensor, Tensor, Tensor]:
        """(B, H, W) depth in metres with and without the patch, and the bool mask of pixels that show no patch."""

        def said(sample: Any) -> Tensor:
            return _output(model, as_batch([sample.images], list(views)), "depth_m")[0]

        clean = self._clean.of(model, samples, indices, said)
        depth_m = _output(model, views, "depth_m")
        return depth_m, clean.to(depth_m.device, depth_m.dtype), outside(samples, next(iter(views)), depth_m.device)

    def _pushed(self, depth_m: Tensor, clean: Tensor, free: Tensor) -> Tensor:
        sign = 1.0 if self._direction == "farther" else -1.0
        change = depth_m.clamp_min(1e-3).log() - clean.clamp_min(1e-3).log()
        return sign * _mean(change, free)


@dataclass(frozen=True, slots=True, kw_only=True)
class LossObjective:
    """An objective of the model's own training losses against the ground truth, for detectors and stereo networks.

    Attributes:
        signs: weight of each loss by name: 1 maximises it, -1 minimises it, 0 ignores it. Losses without an entry have
            weight 1.
    """

    signs: Mapping[str, float]

    def terms(
        self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indices: Sequence[int]
    ) -> Mapping[str, Term]:
        """Returns one term for each loss of the model with a weight other than 0, by the name of the loss.

        Args:
            model: the attacked network.
            views: (B, 3, H, W) pictures with the patches by camera name, float in 0..1.
            samples: the B samples with their ground truth.
            indices: not used.
        """
        losses = model.forward(views, samples)
        signs = {name: self.signs.get(name, 1.0) for name in losses}
        return {name: Term(value=loss, weight=signs[name]) for name, loss in losses.items() if signs[name]}


def counted(
    objective: Objective,
    model: Model,
    views: Mapping[str, Tensor],
    samples: Sequence[Any],
    indices: Sequence[int],
) -> list[Tensor]:
    """Scalars whose sum is the harm, by which attacks without gradients compare patches; over all members of a group.

    For each member the harm is the objective's `harm` if it has this method, otherwise its weighted terms. The terms
    against a member's defense are included.

    Args:
        objective: objective of the attack.
        model: the attacked network, or a group of networks.
        views: (B, 3, H, W) pictures with the patches by camera name, float in 0..1.
        samples: the B samples with their ground truth.
        indices: indices of these samples in the dataset.
    """
    if isinstance(objective, HarmObjective):
        harms = [objective.harm(member, views, samples, indices) for member in members_of(model).values()]
        terms = [
            term for member in members_of(model).values() for term in defense_terms(member, views, samples).values()
        ]
        return harms + [term.weight * term.value for term in terms]
    return weighted(objective, model, views, samples, indices)


def weighted(
    objective: Objective,
    model: Model,
    views: Mapping[str, Tensor],
    samples: Sequence[Any],
    indices: Sequence[int],
) -> list[Tensor]:
    """The weighted terms of the objective over all members of a group, for attacks that maximise their sum.

    Args:
        objective: objective of the attack.
        model: the attacked network, or a group of networks.
        views: (B, 3, H, W) pictures with the patches by camera name, float in 0..1.
        samples: the B samples with their ground truth.
        indices: indices of these samples in the dataset.
    """
    return [
        term.weight * term.value
        for member in members_of(model).values()
        for term in all_terms(objective, member, views, samples, indices).values()
    ]


def all_terms(
    objective: Objective,
    member: Model,
    views: Mapping[str, Tensor],
    samples: Sequence[Any],
    indices: Sequence[int],
) -> dict[str, Term]:
    """The objective's terms for one model by name, and the terms against the model's defense if there is one.

    Args:
        objective: objective of the attack.
        member: the attacked network, or one member of a group.
        views: (B, 3, H, W) pictures with the patches by camera name, float in 0..1.
        samples: the B samples with their ground truth.
        indices: indices of these samples in the dataset.
    """
    return {**objective.terms(member, views, samples, indices), **defense_terms(member, views, samples)}


def defense_terms(member: Model, views: Mapping[str, Tensor], samples: Sequence[Any]) -> dict[str, Term]:
    """Terms against a model's defense: `defense_score` grows as the score falls, `defense_mask` as the mask shrinks.

    They are the negative mean of the scores, and the negative mean of the unrounded mask over the visible pixels of the
    patch. Both come from the defense-aware attacks of Z-Mask's supplement (Rossolini et al., AAAI 2023). The result is
    empty for a model without a defense, for a defense that returns neither score nor mask, and for weights of 0.

    Args:
        member: the attacked network, with or without a defense.
        views: (B, 3, H, W) pictures with the patches by camera name, float in 0..1.
        samples: the B samples with the position of their patches.
    """
    if not isinstance(member, Defended):
        return {}
    batch, terms = member.defended(views), {}
    if batch.scores is not None and member.weights.score:
        terms["defense_score"] = Term(value=-batch.scores.mean(), weight=member.weights.score)
    if batch.masks and member.weights.mask:
        means = [_mean(mask, ~outside(samples, view, mask.device)) for view, mask in batch.masks.items()]
        terms["defense_mask"] = Term(value=-torch.stack(means).mean(), weight=member.weights.mask)
    return terms


def not_finite(what: str, indices: Sequence[int]) -> GearError:
    """Makes the error for a NaN or infinite value; the message names the samples for which the value was computed.

    Args:
        what: the value, for the message, such as `the objective`.
        indices: indices of the samples.
    """
    which = f"sample{'s' * (len(indices) > 1)} {', '.join(map(str, indices))}"
    return GearError(
        f"{what} is NaN or infinite, because the model's output for {which} with the patch is; check its weights"
    )


def loss_names(model: Model, sample: Any) -> list[str]:
    """The names of a model's training losses, in the order in which its `forward` with targets returns them.

    For a `Group` of models: the names of all members' losses, without the members' prefixes, each name once.

    Args:
        model: the attacked model, or a group of models; it runs once, without gradients.
        sample: one sample with pictures and ground truth.
    """
    views = as_batch([sample.images], list(sample.images))
    with torch.no_grad(), frozen(model):
        found = [name for member in members_of(model).values() for name in member.forward(views, [sample])]
    return list(dict.fromkeys(found))


def train_labels(samples: Sequence[Any], classes: int) -> Tensor:
    """Returns the (B, H, W) int64 target classes of samples; 255 is ignored.

    Args:
        samples: the B samples with `label_ids`.
        classes: number of channels of the logits: 19 for train ids, more for label ids.

    Raises:
        ValueError: there are fewer classes than Cityscapes has train ids.
    """
    labels = torch.from_numpy(np.stack([sample.label_ids for sample in samples])).long()
    trained = TRAIN_IDS[labels]
    if classes == TRAIN_CLASSES:
        return trained
    if classes < TRAIN_CLASSES:
        raise ValueError(f"logits over {classes} classes; Cityscapes has {TRAIN_CLASSES} train ids")
    return torch.where(trained == IGNORED_TRAIN_ID, IGNORED_TRAIN_ID, labels)


def class_of(label_id: int, classes: int) -> int:
    """Returns the channel of a class in logits: its train id for 19 channels, otherwise its label id.

    Args:
        label_id: label id of the class (Cityscapes).
        classes: number of channels of the logits.
    """
    return int(TRAIN_IDS[label_id]) if classes == TRAIN_CLASSES else label_id


def _is_right(logits: Tensor, labels: Tensor) -> Tensor:
    """The (B, H, W) bool mask of pixels whose most probable class is the label; undefined where labels are ignored."""
    # `amax` is much faster than `argmax`.
    given = logits.gather(1, labels.clamp(max=logits.shape[1] - 1)[:, None])[:, 0]
    return given == logits.amax(1)


def _output(model: Model, views: Mapping[str, Tensor], name: str) -> Tensor:
    """The output `name` of a model on pictures; its height and width must be those of the pictures.

    Raises:
        GearError: the model has no such output, or its size differs.
    """
    outputs = model.forward(views)
    if name not in outputs:
        given = ", ".join(outputs) or "nothing"
        raise GearError(
            f"an attack works on the output {name!r}, and the network gives {given} (docs/how-to/write-a-model.md)"
        )
    said, size = outputs[name], next(iter(views.values())).shape[-2:]
    if said.shape[-2:] != size:
        there, wanted = (" x ".join(map(str, shape)) for shape in (said.shape[-2:], size))
        raise GearError(
            f"an attack works on {name!r} at the picture's size, {wanted}, and the network gives {there} "
            "(docs/how-to/write-a-model.md)"
        )
    return said


def _logits(model: Model, views: Mapping[str, Tensor]) -> Tensor:
    """(B, C, H, W) logits of a network over the 19 train ids or the 34 label ids of Cityscapes.

    Raises:
        GearError: the network has another number of classes.
    """
    logits = _output(model, views, "logits")
    known = TRAIN_CLASSES, len(TRAIN_IDS)
    if logits.shape[1] not in known:
        raise GearError(
            f"an attack works on logits over Cityscapes' {known[0]} train ids or {known[1]} label ids, and the network "
            f"gives {logits.shape[1]} classes (docs/how-to/write-a-model.md)"
        )
    return logits


@functools.lru_cache(maxsize=64)
def _mask(counts: str, height: int, width: int) -> npt.NDArray[np.bool_]:
    mask = rle.decode(counts, height, width)
    mask.setflags(write=False)
    return mask


def _split(values: Tensor, parts: Mapping[str, tuple[Tensor, float]]) -> Mapping[str, Term]:
    """One term for each part of the pixels: the mean of the values over the part, with the part's weight.

    Parts that are empty or have weight 0 give no term. Counting the pixels of a part is several times as fast as `any`.
    """
    return {n: Term(value=_mean(values, where), weight=w) for n, (where, w) in parts.items() if w and where.sum()}


def _mean(values: Tensor, where: Tensor) -> Tensor:
    """The mean of values over the selected pixels; 0 with a gradient of 0 if no pixel is selected."""
    # The mask is converted once: a product with bools converts them in the forward and in the backward pass.
    return (values * where.to(values.dtype)).sum() / where.sum().clamp_min(1)
