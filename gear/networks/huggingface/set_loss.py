"""Set losses of transformers' detectors, computed in float32. Queries inside ignored objects do not count as
background.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from inspect import signature
from typing import Any

import torch
from torch import Tensor
from torch.nn import functional

from gear.networks.detection.network import MOSTLY, share_inside

PAIRS = (
    ("logits", "pred_boxes"),
    ("outputs_class", "outputs_coord"),
    ("enc_topk_logits", "enc_topk_bboxes"),
    ("enc_outputs_class", "enc_outputs_coord"),
)
"""Pairs of names of the losses' arguments: class logits and boxes of the queries of the last layer, of all layers,
and of the encoder.
"""

BATCH_FIRST = "enc_topk_logits"
"""Name of an argument. Losses that have it expect the queries of all layers as (B, layers, …), other losses as
(layers, B, …).
"""

DENOISING, NOTHING_NOISED = "denoising_meta_values", {"dn_num_split": (0,)}
NOISED = ("logits", "outputs_class")
"""Names of arguments with class logits. In training they also hold denoising queries, which start with noised
boxes of the objects and are always used.
"""

IGNORED = "ignored"
"""Key of the labels for boxes that are neither targets nor background; boxes of targets have the key `boxes`."""

NEAR = 0.4
"""IoU with a target's box above which a query belongs to this target, as with RetinaNet's anchors."""

SURE, FAR = 50.0, 10.0
"""Values for queries that the loss must not use: the background logit, and the box centre in units of the
picture's sides (far outside).
"""


def set_loss(loss: Callable[..., Any], device_type: str, *arguments: Any, **more: Any) -> Any:
    """Calls a loss of transformers in float32, whatever the precision of the network's output.

    Queries that lie mostly inside ignored objects and near no target are replaced by certain background far outside the
    picture. The loss then matches such queries with no target and learns nothing from them. If too few other queries
    would remain for the objects of a picture, all of its queries are used. In losses that match queries in groups, the
    queries of each group are replaced in this way.

    Args:
        loss: loss function of transformers.
        device_type: type of the torch device, such as `cpu`.
        *arguments: arguments of the loss.
        **more: keyword arguments of the loss.

    Returns:
        What `loss` returns.
    """
    call = signature(loss).bind(*arguments, **more)
    given = call.arguments
    given.update({name: _float(value) for name, value in given.items()})
    with torch.autocast(device_type, enabled=False):
        for classes, boxes in PAIRS:
            if isinstance(given.get(classes), Tensor):
                config, batch = given["config"], 1 if classes == "outputs_class" and BATCH_FIRST not in given else 0
                noised = (given.get(DENOISING) or NOTHING_NOISED)["dn_num_split"][0] if classes in NOISED else 0
                group = getattr(config, "num_queries", given[boxes].shape[-2])
                hidden = _hidden(given[boxes].detach(), given["labels"], batch, noised, group)
                given[classes], given[boxes] = _without(hidden, given[classes], given[boxes], config.num_labels)
        return loss(*call.args, **call.kwargs)


def is_hidden(boxes: Tensor, labels: Mapping[str, Tensor]) -> Tensor:
    """The (…, N) bool mask of the queries of a picture that the loss must not use.

    Args:
        boxes: (…, N, 4) boxes of the queries: centre and size as shares of the picture's size.
        labels: `boxes` of targets and `ignored` boxes, in the same format.
    """
    from transformers.loss.loss_for_object_detection import box_iou

    flat, wanted = _edges(boxes.reshape(-1, 4)), _edges(labels["boxes"])
    hidden = share_inside(flat, _edges(labels[IGNORED])) >= MOSTLY
    if len(wanted):
        hidden &= box_iou(flat, wanted)[0].amax(dim=1) <= NEAR
    hidden = hidden.reshape(boxes.shape[:-1])
    return hidden & ((~hidden).sum(dim=-1, keepdim=True) >= len(wanted))


def _hidden(boxes: Tensor, labels: Sequence[Mapping[str, Tensor]], batch: int, noised: int, group: int) -> Tensor:
    """(…, N) bool for (…, N, 4) boxes; `batch` is the index of the dimension that counts pictures."""
    count = boxes.shape[-2] - noised
    group = group if count % group == 0 else count
    grouped = boxes[..., noised:, :].reshape(*boxes.shape[:-2], count // group, group, 4)
    each = [is_hidden(one, label) for one, label in zip(grouped.unbind(batch), labels, strict=True)]
    return functional.pad(torch.stack(each, dim=batch).flatten(-2), (noised, 0), value=False)


def _without(hidden: Tensor, logits: Tensor, boxes: Tensor, classes: int) -> tuple[Tensor, Tensor]:
    """Logits and boxes, with the hidden queries replaced by certain background far away."""
    background, away = torch.full_like(logits, -SURE), torch.zeros_like(boxes)
    if logits.shape[-1] > classes:
        background[..., -1] = SURE
    away[..., :2] = FAR
    return torch.where(hidden[..., None], background, logits), torch.where(hidden[..., None], away, boxes)


def _edges(boxes: Tensor) -> Tensor:
    return torch.cat([boxes[:, :2] - boxes[:, 2:] / 2, boxes[:, :2] + boxes[:, 2:] / 2], dim=1)


def _float(value: Any) -> Any:
    return value.float() if isinstance(value, Tensor) and value.is_floating_point() else value
