"""The two configs of a collection: what to collect (task, town, scene, patch), and seeds and sizes of the splits."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Literal

from gear.camera.effects import CameraEffects
from gear.config.nodes import Mapping, Node, Place
from gear.contracts.rendering import Quality
from gear.values.derived_fields import DerivedField, attribute_lines, with_fields
from gear.values.errors import FieldError
from gear.values.scene import WEATHER_PARAMETERS, Weather, check_weather
from gear.values.serial import PLACES
from gear.values.vehicle_mix import check_mix

SPLIT_NAME = re.compile(r"(?!(gear|patches|scratch)$)[a-z][a-z0-9]*(_[a-z0-9]+)*")
"""Pattern of valid split names; `gear`, `patches` and `scratch` are folders of gear in a dataset and no valid names."""


_WEATHER_FIELDS = [DerivedField(name=name, kind=float | None, field=field(default=None)) for name in WEATHER_PARAMETERS]


@with_fields(_WEATHER_FIELDS, attribute_lines(Weather, without=["name"]))
class WeatherConfig:
    """A weather preset and the parameters that differ from it; a parameter that is None has the preset's value.

    The parameters are those of `gear.values.scene.Weather`.

    Attributes:
        places: file, line and column of each given value, by key.
        preset: name of a weather preset.
    """

    SHORTHAND: ClassVar[str] = "preset"

    preset: str = "ClearNoon"
    places: dict[str, Place] = field(default_factory=dict, compare=False, repr=False, metadata=PLACES)

    if TYPE_CHECKING:

        def __init__(
            self, *, preset: str = ..., places: dict[str, Place] = ..., **parameters: float | None
        ) -> None: ...

    def __post_init__(self) -> None:
        for name in WEATHER_PARAMETERS:
            value = getattr(self, name)
            if value is not None:
                check_weather(name, value)


@dataclass(frozen=True, slots=True, kw_only=True)
class SplitConfig:
    """Seed and size of one split.

    Attributes:
        seed: seed of all random draws of the split.
        samples: number of driving sequences; if `frames` is 1, each sequence is a single picture.
        frames: number of frames per driving sequence.
        interval_s: seconds between two frames of a sequence, 0.001 to 10.
    """

    seed: int
    samples: int
    frames: int = 1
    interval_s: float = 0.1

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise FieldError("seed", f"must not be negative, got {self.seed}")
        if not 1 <= self.samples <= 1_000_000:
            raise FieldError("samples", f"must be 1 to 1000000, got {self.samples}")
        if not 1 <= self.frames <= 100_000:
            raise FieldError("frames", f"must be 1 to 100000, got {self.frames}")
        if not 0.001 <= self.interval_s <= 10:
            raise FieldError("interval_s", f"must be 0.001 to 10 s, got {self.interval_s:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulationConfig:
    """Seeds and sizes of all splits, and upper limits on road users.

    Attributes:
        splits: seed and size of each split, by name; `test_night` uses the entry of `test` unless it has its own.
        max_vehicles, max_pedestrians: upper limits on the numbers of other vehicles and of pedestrians; a scene may set
            lower ones. Scenes without a billboard may have a hundred times as many vehicles, as in CARLA-GeAR.
    """

    splits: dict[str, SplitConfig]
    max_vehicles: int = 21
    max_pedestrians: int = 200

    def __post_init__(self) -> None:
        for name in ("max_vehicles", "max_pedestrians"):
            if not 0 <= getattr(self, name) <= 1000:
                raise FieldError(name, f"must be 0 to 1000, got {getattr(self, name)}")
        for split in self.splits:
            if not SPLIT_NAME.fullmatch(split):
                raise FieldError("splits", f"{split!r} is not a split's name (lower case words joined by _)")


RendererName = Literal["raster", "filament", "classic"]

MOST_CROWDED = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CollectionConfig:
    """The config of one dataset split to collect.

    Attributes:
        task: name of a task plugin.
        town: name of a town, or path of its MJCF.
        scenes: name of a scene library, or path of its YAML; empty for the town's own.
        scene: name of a scene in the library; or path of a library's YAML and the name of a scene in it,
            `my.yml:corner`.
        split: `train`, `val`, `test`, `debug`, `finetuning` or `video`, optionally with a suffix such as `_night`.
        root: folder of the dataset; empty for `data/<task>/<town>-<scene>-<weather>/<patch>`.
        patch: `none`, `random`, a picture, a patch folder, or the name of an installed patch.
        weather: a preset, or a preset and the parameters that differ from it.
        renderer: `raster` (physically based), `filament` (the same appearance, slower) or `classic`.
        quality: `film` (2x2 supersampled) or `fast`.
        camera: optional effects: `shot_noise`, `read_noise` (percent), `vignette`, `shutter_s`, `lens` (`k1`, `k2`).
        seed, samples: replace the values of the simulation config.
        crowd: factor on the scene's numbers of other vehicles and people, and on their upper limits; 0 to 10.
        mix: factors on the frequency of kinds of vehicles, such as `{bus: 3}`.
        patch_seed: seed of random patches, separate from the split's seed, so all splits show the same patch.
        probes: whether to store renders with each patch surface black and white, which the exact compositor needs.
        scans: whether to store a laser scan (Velodyne HDL-64E) of each sample, for `gear export --layout kitti`.
        flow: whether to store the optical flow to the next frame of a driving sequence, for `gear export --layout
            kitti-flow`.
        mixed_devices: whether different graphics devices, drivers and processors may make samples of the split; the
            same config does not give the same bytes then.
        simulation: name or path of the simulation config.
        options: the task's own options (`gear plugins show TASK`).
        places: file, line and column of each given value, by key.
    """

    task: str
    town: str = "town10"
    scenes: str = ""
    scene: str = "billboard01"
    split: str = "test"
    root: str = ""
    patch: str = "none"
    weather: WeatherConfig = field(default_factory=WeatherConfig)
    renderer: RendererName = "raster"
    quality: Quality = "film"
    camera: CameraEffects = field(default_factory=CameraEffects)
    seed: int | None = None
    samples: int | None = None
    crowd: float = 1.0
    mix: dict[str, float] = field(default_factory=dict)
    patch_seed: int = 0
    probes: bool = False
    scans: bool = False
    flow: bool = False
    mixed_devices: bool = False
    simulation: str = "default"
    options: Node = field(default_factory=lambda: Mapping({}, Place("defaults")))
    places: dict[str, Place] = field(default_factory=dict, compare=False, repr=False, metadata=PLACES)

    def __post_init__(self) -> None:
        if not SPLIT_NAME.fullmatch(self.split):
            raise FieldError("split", f"{self.split!r} is not a split's name (lower case words joined by _)")
        if self.seed is not None and self.seed < 0:
            raise FieldError("seed", f"must not be negative, got {self.seed}")
        if self.samples is not None and not 1 <= self.samples <= 1_000_000:
            raise FieldError("samples", f"must be 1 to 1000000, got {self.samples}")
        if not 0 <= self.crowd <= MOST_CROWDED:
            raise FieldError("crowd", f"must be 0 to {MOST_CROWDED:g}, got {self.crowd:g}")
        check_mix("mix", self.mix)
        if not self.scene:
            raise FieldError("scene", "must be a scene's name, such as billboard01")
