"""The registry of effects: one file is all that an effect needs."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from pathlib import Path

import pytest

from gear.camera.effects import EFFECTS, CameraEffects, Lens, recorded_effects
from gear.plugins.describe import meanings_of
from gear.values.errors import FieldError
from gear.values.serial import from_json, to_json
from tests.camera.effects.scenes import exposure, raw

NEW_EFFECT = '''
from dataclasses import dataclass, replace
from typing import ClassVar
from gear.camera.effects.effect import Effect

@dataclass(frozen=True, slots=True, kw_only=True)
class Tint(Effect):
    """A colour cast.

    Attributes:
        tint: share of red that is lost.
    """

    ORDER: ClassVar[int] = 35
    tint: float = 0.0

    @property
    def is_active(self):
        return self.tint > 0

    def apply(self, view, exposure):
        colour = view.linear_rgb.copy()
        colour[..., 0] = colour[..., 0] * (1 - self.tint)
        return replace(view, linear_rgb=colour)

    def apply_torch(self, light, truth, exposure):
        return light * light.new_tensor([1 - self.tint, 1.0, 1.0])[:, None, None]
'''

USE_IT = """
import sys, importlib.machinery, importlib.util
spec = importlib.util.find_spec("gear.camera.effects")
spec.submodule_search_locations.append(sys.argv[1])
package = importlib.util.module_from_spec(spec)
sys.modules["gear.camera.effects"] = package
spec.loader.exec_module(package)
from gear.config.collection import CollectionConfig
from gear.config.load import load_collection
config = load_collection(None, {"task": "semseg"}, ["camera.tint=0.25", "camera.vignette=0.1"])
print([type(effect).__name__ for effect in config.camera.active()])
from gear.plugins.describe import meanings_of
print(meanings_of(package.CameraEffects)["tint"])
print("cv2" in sys.modules, "torch" in sys.modules)
"""


def test_a_new_file_is_a_new_effect(tmp_path: Path) -> None:
    (tmp_path / "tint.py").write_text(NEW_EFFECT)
    done = subprocess.run([sys.executable, "-c", USE_IT, str(tmp_path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == ["['Vignette', 'Tint']", "share of red that is lost.", "False False"]


def test_effects_are_applied_along_the_way_of_the_light() -> None:
    names = [kind.__name__ for kind in EFFECTS]
    assert names == ["MotionBlur", "LensDistortion", "Vignette", "Noise"]
    everything = CameraEffects(shutter_s=0.01, lens=Lens(k1=0.1), vignette=0.2, read_noise=1.0)
    assert [type(effect).__name__ for effect in everything.active()] == names
    assert [type(effect).__name__ for effect in everything.linear().active()] == names[:-1]
    assert CameraEffects().active() == ()


def test_every_parameter_is_documented_and_survives_json() -> None:
    effects = CameraEffects(shutter_s=0.01, lens=Lens(k1=0.1), vignette=0.2, read_noise=1.0)
    assert from_json(CameraEffects, to_json(effects)) == effects
    assert set(meanings_of(CameraEffects)) == {field.name for field in dataclasses.fields(CameraEffects)}  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", EFFECTS)
def test_inputs_are_never_written(kind: type) -> None:
    parameters = {"MotionBlur": {"shutter_s": 0.01}, "LensDistortion": {"lens": Lens(k1=0.1)},
                  "Vignette": {"vignette": 0.5}, "Noise": {"read_noise": 1.0}}  # fmt: skip
    view = raw()
    for array in (view.linear_rgb, view.depth_m, view.geom_id):
        assert array is not None
        array.setflags(write=False)
    seen = kind(**parameters[kind.__name__]).apply(view, exposure((10.0, 0, 0)))
    assert seen.linear_rgb is not None and (seen.linear_rgb != view.linear_rgb).any()


def test_the_record_of_a_pinhole_holds_no_effect() -> None:
    assert recorded_effects(exposure().camera) == ()


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: CameraEffects(vignette=1.0), "vignette"),
        (lambda: CameraEffects(shot_noise=-1), "shot_noise"),
        (lambda: CameraEffects(shutter_s=2), "shutter_s"),
        (lambda: Lens(k1=0.9), "k1"),
    ],
)
def test_parameters_out_of_range_are_refused(make: object, field: str) -> None:
    with pytest.raises(FieldError, match=field):
        make()  # type: ignore[operator]
