"""Warns if pictures have another size than the training pictures, so objects appear larger or smaller to a
network.

Weights files state the input scale, the factor by which pictures of the task's default size are resized. A network
applies the same factor to pictures of any size, so objects in smaller pictures become smaller still. Weights files that
state no scale were trained on the default size, with the network's default scale.
"""

from __future__ import annotations

from typing import Any

from gear.config.nodes import Node, Place, Scalar
from gear.config.overrides import with_value
from gear.config.reader import read_node
from gear.contracts.specs import ModelSpec, TaskSpec
from gear.dataset.reading import Dataset
from gear.measuring.plugin_selection import Chosen
from gear.networks.input_scale import OPTION, width_share
from gear.networks.options import NONE
from gear.networks.shipped import trained_option
from gear.plugins.build import NO_OPTIONS, build, find, name_of_task
from gear.values.errors import ConfigError


def size_note(model: Chosen, dataset: Dataset[Any]) -> str | None:
    """A warning if the dataset's pictures have another size than those that the model was trained on.

    The result is None if the sizes agree, if the training size is unknown, or if the user set the input scale.

    Args:
        model: the model with its options.
        dataset: dataset on which the model predicts.
    """
    network = _network_with_free_scale(model)
    if network is None:
        return None
    spec, weights = network
    task = find("task", name_of_task(dataset.plan.task)).spec
    assert isinstance(task, TaskSpec)
    width_px, usual_px = dataset.plan.options.get("width_px"), getattr(task.config(), "width_px", None)
    if not width_px or not usual_px or width_share(width_px, usual_px) == 1:
        return None
    said = trained_option(weights, spec.name, OPTION)
    share = spec.input_scale if said is None else said
    if not isinstance(share, (int, float)):
        return None
    wanted = round(share * usual_px / width_px, 4)
    try:
        read_node(spec.config, with_value(model.options, (OPTION,), Scalar(f"{wanted:g}", False, Place("size"))), "")
        remedy = f"--model-set {OPTION}={wanted:g} corrects this"
    except ConfigError:
        remedy = "collect larger ones"
    look = "smaller" if width_px < usual_px else "larger"
    return (
        f"{dataset.root}: pictures are {width_px} px wide and {spec.name} sees them at {share * width_px:.0f} px; it "
        f"learnt from {share * usual_px:.0f} px, so objects look {look} than in its training pictures: {remedy}"
    )


def focal_note(model: Chosen, task: str, options: Node, where: str) -> str | None:
    """A warning if a driver's camera shows objects smaller or larger than the training pictures of its network did.

    The result is None if they have nearly the same size, if the training size is unknown, or if the user set the input
    scale.

    Args:
        model: the network with its options.
        task: name of the task.
        options: options of the task, which decide the camera.
        where: the driver that takes the pictures, for the message, such as `driver depth`.
    """
    network = _network_with_free_scale(model)
    if network is None:
        return None
    spec, _ = network
    found = find("task", task)
    here_px, usual_px = (build(found, one).rig().cameras[0].intrinsics.fx_px for one in (options, NO_OPTIONS))
    share = width_share(round(here_px), round(usual_px))
    if share == 1:
        return None
    look = "smaller" if share < 1 else "larger"
    return (
        f"{where}: its camera has a focal length of {here_px:.0f} px, and {spec.name} learnt from pictures of"
        f" {usual_px:.0f} px, so objects look {look} than in its training pictures: set"
        f" options.focal_px={usual_px:.0f}, or model_set.{OPTION}"
    )


def _network_with_free_scale(model: Chosen) -> tuple[ModelSpec[Any], str] | None:
    """The spec and the weights of a network with an input scale that the user did not set; None for other networks and
    for networks without weights.
    """
    spec = model.found.spec
    assert isinstance(spec, ModelSpec)
    config = read_node(spec.config, model.options, "")
    weights = getattr(config, "weights", NONE)
    return None if getattr(config, OPTION, 1.0) is not None or weights == NONE else (spec, weights)
