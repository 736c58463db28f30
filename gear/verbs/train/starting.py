"""Building a network for training, and what it begins with."""

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
from gear.networks.runtime import device_of, is_quick_in_half, seeded
from gear.networks.shipped import resolve, shipped, shipped_networks, trained_option
from gear.networks.weights import load_into, load_trunk
from gear.plugins.build import blamed, build
from gear.plugins.catalogue import PluginEntry
from gear.readers import Samples
from gear.values.errors import GearError, UnknownNameError
from gear.values.serial import Json
from gear.verbs.train.config import TrainConfig

SCALE = "input_scale"
"""Option of many networks: at which share of the picture's size they run; null leaves it to the weights."""

TRUNK = "trunk:"
"""Before the file, or the name of a network, of which `--init` takes what fits."""

FLAGS = {"weights": "--init", "seed": "--seed", "device": "--device", "precision": "--precision"}
"""Options of a network that the training gives it, and what says them."""


def check_options(found: PluginEntry, config: TrainConfig) -> None:
    """Whether the network's options are left to the training where the training sets them: weights that were slipped in
    here would be noted as random ones, and a precision would hold for validation, too.

    Raises:
        GearError: one of them is given.
    """
    fields = {field.name for field in dataclasses.fields(found.spec.config)}
    given = config.options.entries if isinstance(config.options, Mapping) else {}
    for name, flag in FLAGS.items():
        if name in fields and name in given:
            raise GearError(f"options.{name} is set by the training; say it with {flag}")


def sizes_note(found: PluginEntry, config: TrainConfig, samples: Samples) -> str:
    """What to know where pictures have several sizes and the network would have noted one; nothing elsewhere."""
    widths_px = _widths_px(samples)
    if len(widths_px) == 1 or not _notes_share(found, config):
        return ""
    return (
        f"pictures are {', '.join(map(str, sorted(widths_px)))} px wide: the network sees each as it is, and its"
        f" weights will be used on pictures of the task's own size; --set options.{SCALE}=SHARE says otherwise"
    )


def picture_share(samples: Samples, spec: TaskSpec[Any]) -> float:
    """Width of the pictures as a share of the width that the task has by itself; 1 where there is no saying."""
    usual = getattr(spec.config(), "width_px", None)
    widths_px = _widths_px(samples)
    return width_share(widths_px.pop(), usual) if usual and len(widths_px) == 1 else 1.0


def _widths_px(samples: Samples) -> set[int]:
    return {dataset.sidecar(0).record.cameras[0].width_px for dataset in samples.datasets}


def _notes_share(found: PluginEntry, config: TrainConfig) -> bool:
    """Whether the network's weights say at which share of the task's own pictures they are used, and nobody said it."""
    is_given = isinstance(config.options, Mapping) and SCALE in config.options.entries
    return getattr(found.spec.config(), SCALE, 1.0) is None and not is_given


def with_scale(found: PluginEntry, config: TrainConfig, share: float, begun: Json = None) -> TrainConfig:
    """Lets a network that would run at a share of its pictures' size see small pictures as they are, and those of the
    task's own size at the share that the weights were trained for with which it begins.

    Its weights then say at which share of the task's own pictures they are to be used.

    Args:
        found: whose network it is.
        config: of the training.
        share: as of `picture_share`.
        begun: config of the training that is taken up again, which knows what weights said that are gone since.
    """
    if not _notes_share(found, config):
        return config
    known = _given_scale(begun) if goes_on_alone(found, config.init, begun) else None
    scale = (known or _scale_of_start(found, config.init)) if share == 1 else 1
    if scale is None:
        return config
    options = with_value(config.options, (SCALE,), Scalar(str(scale), False, Place("gear train")))
    return dataclasses.replace(config, options=options)


def goes_on_alone(found: PluginEntry, init: str, begun: Json) -> bool:
    """Whether a training that was begun with weights must do without them: they are gone, and its checkpoint has all
    that the next step depends on.

    Args:
        found: whose network it is.
        init: what it begins with.
        begun: config of the training that is there, or None.
    """
    spec = found.spec
    assert isinstance(spec, ModelSpec)
    if not isinstance(begun, dict) or begun.get("init") != init or init in ("", NONE, *spec.starts):
        return False
    if init == SHIPPED:
        return shipped(spec.name) is None
    source = init.removeprefix(TRUNK)
    return not Path(source).is_file() and (source == init or shipped(source) is None)


def _given_scale(begun: Json) -> Json:
    options = begun.get("options")
    return options.get(SCALE) if isinstance(options, dict) else None


def _scale_of_start(found: PluginEntry, init: str) -> Json:
    """What whole weights that a training begins with say of the share that they were trained for; None for nothing.

    Raises:
        GearError: they are not there, or no safetensors.
    """
    spec = found.spec
    assert isinstance(spec, ModelSpec)
    if init in spec.starts or not (init == SHIPPED or Path(init).is_file()):
        return None
    return trained_option(init, spec.name, SCALE)


def precision_of(found: PluginEntry, config: TrainConfig) -> Literal["float32", "bfloat16"]:
    """Of the training steps: what was asked for; half of it where time counts and the device is quicker so.

    Without a time budget the same command gives the same weights, so there it does not depend on the device.
    """
    if config.precision != "auto":
        return config.precision
    spec = found.spec
    assert isinstance(spec, ModelSpec)
    knows = any(field.name == "precision" for field in dataclasses.fields(spec.config))
    return "bfloat16" if config.time_budget_s and knows and is_quick_in_half(device_of(config.device)) else "float32"


def build_network(found: PluginEntry, config: TrainConfig, *, precision: str) -> Any:
    """The network with random weights from the seed, on the device.

    Options that a network does not have are not given to it: one that knows no `precision` runs at torch's.

    Raises:
        ConfigError: its options do not fit.
        PluginError: a third party's `build` failed.
    """
    wanted = {"weights": NONE, "seed": str(config.seed), "device": config.device, "precision": precision}
    fields = {field.name for field in dataclasses.fields(found.spec.config)}
    options = config.options
    place = Place("gear train")
    for name, text in wanted.items():
        if name in fields:
            options = with_value(options, (name,), Scalar(text, False, place))
    with seeded(config.seed):  # for those that draw their weights from torch's own generator
        return build(found, options)


def go_on_from(model: Any, init: str) -> None:
    """Lets a network that begins with weights train only what they leave to be trained.

    Those of another network's trunk may be few: what stays random is to be trained.
    """
    if init not in ("", NONE) and not init.startswith(TRUNK):
        freeze_trunks(model.module())


def begin_with(found: PluginEntry, model: Any, init: str) -> str:
    """Puts first weights into a network: `shipped`, a file's, those that the network knows by name, or `trunk:` and a
    file or the name of another network with reference weights, for what the two have in common.

    Returns:
        What the user should know of it; mostly nothing.

    Raises:
        GearError: there are none, or they do not fit.
        UnknownNameError: neither a file nor a name that the network knows.
    """
    spec = found.spec
    assert isinstance(spec, ModelSpec)
    if not init or init == NONE:
        return _kept_at_random(spec, model)
    if init in spec.starts:
        with blamed(found, f"starts[{init!r}]"):
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
    """What to know of a network of which part is never trained, since published weights are what it begins with."""
    kept = sum(one.numel() for one in model.module().parameters() if not one.requires_grad)
    if not kept:
        return ""
    ways = " or ".join(spec.starts) or "FILE"
    return (
        f"{spec.name} leaves a part as it begins, which is at random ({kept / 1e6:.2g} M numbers are never trained):"
        f" it learns little so; begin with --init {ways}"
    )


def _trunk(source: str) -> Path:
    """The file that `trunk:` is followed by, as itself or as the name of a network."""
    path = shipped(source) or Path(source)
    if not path.exists() and not path.suffix:
        raise UnknownNameError("reference weights", source, shipped_networks(), "or give a safetensors file")
    return path
