"""Contexts that do not start: the error names the setting or the package that is the reason."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from gear.render import glcontext
from gear.values.errors import BackendError

SETTINGS = ("MUJOCO_GL", "PYOPENGL_PLATFORM", "MUJOCO_EGL_DEVICE_ID")


@pytest.fixture(autouse=True)
def _no_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in SETTINGS:
        monkeypatch.delenv(name, raising=False)


def probe_in_a_process(renderer: str, **settings: str) -> str:
    """The last line of stderr of a process that probes a renderer."""
    kept = {name: value for name, value in os.environ.items() if name not in SETTINGS}
    code = f"from gear.render import probe; probe({renderer!r})"
    done = subprocess.run(
        [sys.executable, "-c", code], env=kept | settings, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    return done.stderr.strip().splitlines()[-1]


def test_osmesa_is_taken_where_egl_does_not_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(glcontext, "_egl_devices", list)
    monkeypatch.setattr(glcontext, "_loads", lambda library: True)
    assert glcontext.choose_backend("classic") == "osmesa"


def test_without_opengl_the_error_names_the_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(glcontext, "_loads", lambda library: False)
    with pytest.raises(BackendError, match=r"libEGL.so.1 is not installed.*apt-get install libegl1 libopengl0"):
        glcontext.choose_backend("classic")


@pytest.mark.parametrize("wish", ["egl", "osmesa", " EGL "])
def test_the_setting_of_the_environment_is_followed(monkeypatch: pytest.MonkeyPatch, wish: str) -> None:
    monkeypatch.setenv("MUJOCO_GL", wish)
    assert glcontext.choose_backend("classic") == wish.strip().lower()
    assert glcontext.backend_setting() == "MUJOCO_GL"


def test_the_raster_renderer_names_the_setting_that_keeps_it_from_egl() -> None:
    last = probe_in_a_process("raster", MUJOCO_GL="osmesa")
    assert "renderer raster: it needs EGL, and MUJOCO_GL is osmesa; unset MUJOCO_GL, or use --renderer filament" in last


@pytest.mark.parametrize("renderer", ["raster", "classic"])
def test_a_missing_egl_driver_is_named_with_its_package(renderer: str) -> None:
    """MuJoCo's setting is not mentioned where nobody set it."""
    forced = {"MUJOCO_GL": "egl"} if renderer == "classic" else {}  # it would take OSMesa
    last = probe_in_a_process(renderer, __EGL_VENDOR_LIBRARY_DIRS="/nonexistent", **forced)
    assert "EGL finds no driver; unset __EGL_VENDOR_LIBRARY_DIRS, or apt-get install libegl-mesa0" in last
    assert "MUJOCO_GL" not in last


def test_a_driver_that_does_not_start_is_named_with_its_package() -> None:
    if not probe_is_mesa():
        pytest.skip("needs Mesa's software driver")
    last = probe_in_a_process("raster", LIBGL_DRIVERS_PATH="/nonexistent")
    assert "unset LIBGL_DRIVERS_PATH, or apt-get install libgl1-mesa-dri" in last and "MUJOCO_GL" not in last


def probe_is_mesa() -> bool:
    code = "from gear.render import probe; print(probe('raster').info.device)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return "llvmpipe" in done.stdout


@pytest.mark.parametrize("number", ["77", "first"])
def test_a_device_that_is_not_there_is_one_line(number: str) -> None:
    last = probe_in_a_process("raster", MUJOCO_EGL_DEVICE_ID=number)
    assert f"MUJOCO_EGL_DEVICE_ID is '{number}', and EGL has the devices 0 to " in last
    assert "unset it" in last and "apt-get" not in last


def test_a_platform_that_pyopengl_does_not_know_is_named() -> None:
    last = probe_in_a_process("raster", PYOPENGL_PLATFORM="nonsense")
    assert "PYOPENGL_PLATFORM is 'nonsense', and gear renders through EGL or OSMesa; unset PYOPENGL_PLATFORM" in last
