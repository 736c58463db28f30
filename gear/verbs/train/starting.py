"""Builds a network for training and loads its initial weights."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any, Literal

from gear.config.nodes import Mapping, Place, Scalar
from gear.config.overrides import with_value
from gear.contracts.specs import ModelSpec, TaskSpec
from gear.networks.efficientnet_lite0 import freeze_trunks
from gear.networks.input_scale import width_share
from gear.networks.options import NONE, SHIPPED
from gear.networks.runtime import device_of, seeded, supports_bfloat16
from gear.networks.shipped import resolve, shipped, shipped_networks, trained_option
from gear.networks.weights import load_into, load_trunk
from gear.plugins.build import blamed, build
from gear.plugins.catalogue import PluginEntry
from gear.readers import Samples
from gear.values.errors import GearError, UnknownNameError
from gear.values.serial import Json
from gear.verbs.train.config import TrainConfig

SCALE = "input_scale"
"""Network option: factor by which the network resizes its input pictures; null takes the value from the weights."""

TRUNK = "trunk:"
"""Prefix in `--init`: of the file or network named after it, only weights with matching keys and shapes are loaded."""

FLAGS = {"weights": "--init", "seed": "--seed", "device": "--device", "precision": "--precision"}
"""Network options that the training sets itself, with the command-line flag that controls each."""


def check_options(plugin: PluginEntry, config: TrainConfig) -> None:
    """Checks that the user gave no network option that the training sets itself, such as `weights` or `precision`.

    Initial weights given as an option would be recorded as random weights, and a precision would also apply to
    validation.

    Args:
        plugin: the network's plugin.
        config: config of the training.

    Raises:
        GearError: such an option is given.
    """
    fields = {field.name for field in dataclasses.fields(plugin.spec.config)}
    given = config.options.entries if isinstance(config.options, Mapping) else {}
    for name, flag in FLAGS.items():
        if name in fields and name in given:
            raise GearError(f"options.{name} is set by the training; say it with {flag}")


def sizes_note(plugin: PluginEntry, config: TrainConfig, samples: Samples) -> str:
    """Returns a warning if the pictures have several sizes and the weights would record the scale of one size;
    otherwise an empty text.

    Args:
        plugin: the network's plugin.
        config: config of the training.
        samples: training samples.
    """
    widths_px = _widths_px(samples)
    if len(widths_px) == 1 or not _notes_share(plugin, config):
        return ""
    return (
        f"pictures are {', '.join(map(str, sorted(widths_px)))} px wide: the network sees each unscaled, and its"
        f" weights will be used on pictures of the task's own size; --set options.{SCALE}=SHARE says otherwise"
    )


def picture_share(samples: Samples, spec: TaskSpec[Any]) -> float:
    """Returns the width of the pictures divided by the task's default width; 1 if the pictures have several widths.

    Args:
        samples: training samples.
        spec: spec of the task.
    """
    usual = getattr(spec.config(), "width_px", None)
    widths_px = _widths_px(samples)
    return width_share(widths_px.pop(), usual) if usual and len(widths_px) == 1 else 1.0


def _widths_px(samples: Samples) -> set[int]:
    return {dataset.sidecar(0).record.cameras[0].width_px for dataset in samples.datasets}


def _notes_share(found: PluginEntry, config: TrainConfig) -> bool:
    """Whether the network's weights record the scale of the pictures that they are for, and no option sets that
    scale.
    """
    is_given = isinstance(config.options, Mapping) and SCALE in config.options.entries
    return getattr(found.spec.config(), SCALE, 1.0) is None and not is_given


def with_scale(plugin: PluginEntry, config: TrainConfig, share: float, earlier_config: Json = None) -> TrainConfig:
    """Returns the config with the network option `input_scale`: the factor by which the network itself resizes its
    input pictures.

    Training pictures that are smaller than the task's default are used unscaled. For pictures of the default size, the
    scale of the initial weights is used. The new weights record the scale for their later use.

    Args:
        plugin: the network's plugin.
        config: config of the training.
        share: width of the training pictures divided by the task's default width.
        earlier_config: config of the resumed training; it records the scale of initial weights that have been deleted
            since.
    """
    if not _notes_share(plugin, config):
        return config
    known = _given_scale(earlier_config) if resumes_without_init(plugin, config.init, earlier_config) else None
    scale = (known or _scale_of_start(plugin, config.init)) if share == 1 else 1
    if scale is None:
        return config
    options = with_value(config.options, (SCALE,), Scalar(str(scale), False, Place("gear train")))
    return dataclasses.replace(config, options=options)


def resumes_without_init(plugin: PluginEntry, init: str, earlier_config: Json) -> bool:
    """Whether a resumed training continues without its initial weights, because their file no longer exists.

    The checkpoint contains everything on which the next step depends, so the initial weights are not needed.

    Args:
        plugin: the network's plugin.
        init: the initial weights, as in `TrainConfig.init`.
        earlier_config: config of the training in the folder; None if there is none.
    """
    spec = plugin.spec
    assert isinstance(spec, ModelSpec)
    if not isinstance(earlier_config, dict) or earlier_config.get("init") != init or init in ("", NONE, *spec.starts):
        return False
    if init == SHIPPED:
        return shipped(spec.name) is None
    source = init.removeprefix(TRUNK)
    return not Path(source).is_file() and (source == init or shipped(source) is None)


def _given_scale(begun: Json) -> Json:
    options = begun.get("options")
    return options.get(SCALE) if isinstance(options, dict) else None


def _scale_of_start(found: PluginEntry, init: str) -> Json:
    """Returns the input scale that the initial weights were trained for; None if they record none.

    Raises:
        GearError: the file is missing or no safetensors file.
    """
    spec = found.spec
    assert isinstance(spec, ModelSpec)
    if init in spec.starts or not (init == SHIPPED or Path(init).is_file()):
        return None
    return trained_option(init, spec.name, SCALE)


def precision_of(plugin: PluginEntry, config: TrainConfig) -> Literal["float32", "bfloat16"]:
    """Returns the precision of the training steps.

    It is the requested precision. For `auto` it is bfloat16 if there is a time budget and the device is faster in
    bfloat16, else float32. Without a time budget the same command gives the same weights, so `auto` then does not
    depend on the device.

    Args:
        plugin: the network's plugin.
        config: config of the training.
    """
    if config.precision != "auto":
        return config.precision
    spec = plugin.spec
    assert isinstance(spec, ModelSpec)
    knows = any(field.name == "precision" for field in dataclasses.fields(spec.config))
    return "bfloat16" if config.time_budget_s and knows and supports_bfloat16(device_of(config.device)) else "float32"


def build_network(plugin: PluginEntry, config: TrainConfig, *, precision: str) -> Any:
    """Builds the network on its device, with random weights drawn from the seed.

    The options `weights`, `seed`, `device` and `precision` are set only if the network has them.

    Args:
        plugin: the network's plugin.
        config: config of the training.
        precision: `float32` or `bfloat16`.

    Raises:
        ConfigError: an option does not fit.
        PluginError: the `build` function of another package failed.
    """
    wanted = {"weights": NONE, "seed": str(config.seed), "device": config.device, "precision": precision}
    fields = {field.name for field in dataclasses.fields(plugin.spec.config)}
    options = config.options
    place = Place("gear train")
    for name, text in wanted.items():
        if name in fields:
            options = with_value(options, (name,), Scalar(text, False, place))
    with seeded(config.seed):  # for networks that draw their weights from torch's global generator
        return build(plugin, options)


def freeze_pretrained(model: Any, init: str) -> None:
    """Freezes the parts of a network that are not trained further after published weights are loaded.

    A network with random weights, or with weights loaded by `trunk:`, is trained as a whole.

    Args:
        model: the built network.
        init: the initial weights, as in `TrainConfig.init`.
    """
    if init not in ("", NONE) and not init.startswith(TRUNK):
        freeze_trunks(model.module())


def load_initial_weights(plugin: PluginEntry, model: Any, init: str) -> str:
    """Loads initial weights into a network.

    Args:
        plugin: the network's plugin.
        model: the built network.
        init: "" or `none` for random weights, `shipped`, a safetensors file, a name that the network defines, or
            `trunk:` followed by a file or by a network with reference weights; `trunk:` loads the weights whose keys
            and shapes match.

    Returns:
        A note for the user; empty if there is nothing to note.

    Raises:
        GearError: these weights do not exist, or do not fit the network.
        UnknownNameError: `init` is neither a file nor a name that the network defines.
    """
    spec = plugin.spec
    assert isinstance(spec, ModelSpec)
    if not init or init == NONE:
        return _kept_at_random(spec, model)
    if init in spec.starts:
        with blamed(plugin, f"starts[{init!r}]"):
            spec.starts[init](model)
    elif init == SHIPPED:
        path = resolve(SHIPPED, spec.name)
        assert path is not None
        load_into(model.module(), path)
    elif init.startswith(TRUNK):
        path = _trunk(init.removeprefix(TRUNK))
        loaded, total = load_trunk(model.module(), path)
        return f"{loaded / total:.0%} of the network's numbers are those of {path.name}; the rest is random"
    elif Path(init).is_file():
        load_into(model.module(), init)
    elif Path(init).suffix:
        raise GearError(f"--init {init}: there is no such file")
    else:
        raise UnknownNameError("start", init, (SHIPPED, *spec.starts), f"for {spec.name}; or give a safetensors file")
    return ""


def _kept_at_random(spec: ModelSpec[Any], model: Any) -> str:
    """Returns a warning if a part of the network has random weights and is never trained; otherwise an empty text."""
    kept = sum(one.numel() for one in model.module().parameters() if not one.requires_grad)
    if not kept:
        return ""
    ways = " or ".join(spec.starts) or "FILE"
    return (
        f"{spec.name} leaves a part as it begins, which is at random ({kept / 1e6:.2g} M numbers are never trained):"
        f" it learns little so; begin with --init {ways}"
    )


def _trunk(source: str) -> Path:
    """Returns the path of the weights file named after `trunk:`, by a path or by the name of a network with
    reference weights.
    """
    path = shipped(source) or Path(source)
    if not path.exists() and not path.suffix:
        raise UnknownNameError("reference weights", source, shipped_networks(), "or give a safetensors file")
    return path
