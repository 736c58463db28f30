"""Weather: one table of parameters with ranges and documents; and what follows from it."""

from __future__ import annotations

import dataclasses

import pytest

from gear.config.collection import WeatherConfig
from gear.plugins.describe import meanings_of
from gear.values.errors import FieldError
from gear.values.scene import WEATHER_PARAMETERS, CameraRecord, Pose, Weather


def test_the_config_of_weathers_has_every_parameter_with_its_document_and_range() -> None:
    names = [field.name for field in dataclasses.fields(Weather)]
    assert names == ["name", *WEATHER_PARAMETERS]
    of_config = {field.name for field in dataclasses.fields(WeatherConfig)}  # type: ignore[arg-type]
    assert of_config == {"preset", "places", *WEATHER_PARAMETERS}
    documents = meanings_of(Weather)
    for name, field in WEATHER_PARAMETERS.items():
        assert meanings_of(WeatherConfig)[name] == documents[name] != ""
        low, high = field.metadata["low"], field.metadata["high"]
        assert f"{low} to {high}" in documents[name]
        WeatherConfig(**{name: low}), WeatherConfig(**{name: high})
        for wrong in (low - 0.1, high + 0.1, float("nan")):
            with pytest.raises(FieldError, match=f"{low} to {high}") as caught:
                WeatherConfig(**{name: wrong})
            assert caught.value.field == name
            with pytest.raises(FieldError, match=name):
                Weather(name="w", **{name: wrong})


def test_rain_falls_from_clouds() -> None:
    def cover(cloudiness: float, precipitation: float) -> float:
        return Weather(name="w", cloudiness=cloudiness, precipitation=precipitation).cloud_cover

    assert cover(30, 0) == 0.3
    assert cover(30, 1e-6) == pytest.approx(0.82)
    assert cover(30, 100) == pytest.approx(1.0) and cover(95, 10) == 0.95
    wet = Weather(name="w", cloudiness=20, precipitation=5)
    assert wet.exposure_cover == 0.8 and dataclasses.replace(wet, precipitation=0).exposure_cover == 0.2


def test_a_camera_record_hands_its_pinhole_on() -> None:
    pose = Pose(position_m=(0.0, 0.0, 0.0))
    camera = CameraRecord(
        name="c", width_px=100, height_px=50, focal_px=80.0, focal_y_px=70.0, principal_px=(40.0, 30.0),
        world_from_camera=pose,
    )  # fmt: skip
    pinhole = camera.intrinsics
    assert (pinhole.fx_px, pinhole.fy_px, pinhole.cx_px, pinhole.cy_px) == (80.0, 70.0, 40.0, 30.0)
    assert not pinhole.is_symmetric
    plain = dataclasses.replace(camera, focal_y_px=None, principal_px=None).intrinsics
    assert (plain.fy_px, plain.cx_px, plain.cy_px) == (80.0, 49.5, 24.5) and plain.is_symmetric
