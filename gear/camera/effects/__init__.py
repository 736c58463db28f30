"""Optional effects of the camera, one file each: motion blur, lens distortion, vignette, noise.

A new effect is one new module in this folder with one subclass of `Effect`; no other file must be changed. Its
parameters become keys of the config's `camera` section. The effect is then applied to pictures, to ground truth and to
composed patches, in the order that its `ORDER` gives.
"""

from __future__ import annotations

import dataclasses
import importlib
import pkgutil
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from gear.camera.effects.effect import Effect, Exposure, PixelMap, PixelSamples
from gear.camera.effects.lens import Lens
from gear.values.derived_fields import DerivedField, attribute_lines, with_fields
from gear.values.scene import CameraRecord
from gear.values.serial import type_hints

__all__ = ["EFFECTS", "CameraEffects", "Effect", "Exposure", "Lens", "PixelMap", "PixelSamples", "recorded_effects"]


def _find_effects() -> tuple[type[Effect], ...]:
    """The subclasses of `Effect` in this folder's modules, in the order in which they are applied.

    Raises:
        TypeError: an effect that is not linear has a lower order than a linear one.
    """
    modules = [importlib.import_module(f"{__name__}.{found.name}") for found in pkgutil.iter_modules(__path__)]
    classes = [value for module in modules for value in vars(module).values() if isinstance(value, type)]
    kinds = {kind for kind in classes if issubclass(kind, Effect) and kind is not Effect}
    effects = tuple(sorted(kinds, key=lambda kind: (kind.ORDER, kind.__name__)))
    if [kind.IS_LINEAR for kind in effects] != sorted((kind.IS_LINEAR for kind in effects), reverse=True):
        raise TypeError("camera effects that are not linear must come after all that are")
    return effects


EFFECTS: tuple[type[Effect], ...] = _find_effects()
"""The classes of all camera effects, in the order in which the effects are applied, from the scene to the sensor."""


def _parameters() -> Iterator[DerivedField]:
    """The parameters of all effects; `with_fields` refuses a name that two effects share."""
    for effect in EFFECTS:
        for field in dataclasses.fields(effect):  # type: ignore[arg-type]
            default: Any = dataclasses.field(default=field.default, default_factory=field.default_factory)
            yield DerivedField(name=field.name, kind=type_hints(effect)[field.name], field=default)


@with_fields(_parameters(), "\n".join(attribute_lines(effect) for effect in EFFECTS))
class CameraEffects:
    """Parameters of all camera effects in one object, for the config's `camera` section; by default all effects
    are off.

    The constructor takes them by name and raises `FieldError` for a value out of range.
    """

    if TYPE_CHECKING:

        def __init__(self, **parameters: Any) -> None: ...

        def __getattr__(self, name: str) -> Any: ...

    def __post_init__(self) -> None:
        self.active()

    def active(self) -> tuple[Effect, ...]:
        """The effects that are switched on by these parameters, in the order in which they are applied.

        Raises:
            FieldError: a parameter is out of its range; the message names it.
        """
        effects = (self._effect(kind) for kind in EFFECTS)
        return tuple(effect for effect in effects if effect.is_active)

    def linear(self) -> CameraEffects:
        """A copy in which effects that are not linear in light, such as noise, are switched off."""
        names = {f.name for kind in EFFECTS if kind.IS_LINEAR for f in dataclasses.fields(kind)}  # type: ignore[arg-type]
        return CameraEffects(**{name: getattr(self, name) for name in names})

    def _effect(self, kind: type[Effect]) -> Effect:
        """The effect of one class, with its parameters from this object."""
        names = [field.name for field in dataclasses.fields(kind)]  # type: ignore[arg-type]
        return kind(**{name: getattr(self, name) for name in names})


def recorded_effects(camera: CameraRecord) -> tuple[Effect, ...]:
    """Restores the effects that move pixels, such as lens distortion, from the record of a camera with which
    pictures were made.

    Args:
        camera: the camera's record in a scene record.

    Returns:
        An empty tuple for a pinhole camera, otherwise a tuple with one effect.
    """
    found = (kind.from_record(camera) for kind in EFFECTS if kind.MOVES_PIXELS)
    return tuple(effect for effect in found if effect is not None)
