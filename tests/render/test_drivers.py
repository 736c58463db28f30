"""What happens where a driver is missing, and what native code prints."""

from __future__ import annotations

import ctypes.util
import json
import os
import subprocess
import sys

import pytest

from gear.render import RENDERERS, describe, open_renderer, probe
from gear.render.native_output import native_output
from gear.values.errors import UnknownNameError


def test_without_vulkan_the_error_names_the_packages() -> None:
    code = "from gear.render import probe; probe('filament')"
    environment = {**os.environ, "VK_ICD_FILENAMES": "/nowhere.json", "VK_DRIVER_FILES": "/nowhere.json"}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    last = done.stderr.strip().splitlines()[-1]
    assert done.returncode == 1, "Filament must not end the process by itself"
    assert "BackendError: renderer filament:" in last
    assert "apt-get install mesa-vulkan-drivers libvulkan1" in last and "--renderer classic" in last


def test_osmesa_and_egl_render_the_same() -> None:
    code = "from gear.render import probe; r = probe('classic'); print(r.info.backend, r.sha256)"
    results = {}
    # Mesa has no OSMesa any longer from 25.1 on.
    for backend in ("egl", "osmesa") if ctypes.util.find_library("OSMesa") else ("egl",):
        environment = {**os.environ, "MUJOCO_GL": backend}
        environment.pop("PYOPENGL_PLATFORM", None)
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        used, results[backend] = done.stdout.split()
        assert used == backend
    if probe("classic").info.is_software:
        assert len(set(results.values())) == 1


@pytest.mark.parametrize("name", RENDERERS)
def test_a_probe_says_who_renders(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    result = probe(name)
    assert result.info.name == name
    assert result.info.backend in {"filament": ("vulkan",), "raster": ("egl",), "classic": ("egl", "osmesa")}[name]
    assert result.info.driver and result.info.device
    assert len(result.sha256) == 64 and result.sha256 == probe(name).sha256 != probe(name, quality="fast").sha256
    assert result.start_s > 0 and result.frame_s > 0
    assert capfd.readouterr() == ("", "")


def test_an_unknown_renderer_is_named_with_what_was_meant() -> None:
    for ask in (describe, probe):
        with pytest.raises(UnknownNameError, match="did you mean filament"):
            ask("filamnet")
    with pytest.raises(UnknownNameError):
        open_renderer("", None)  # type: ignore[arg-type]


def test_only_known_chatter_is_kept_back(capfd: pytest.CaptureFixture[str]) -> None:
    with native_output() as chatter:
        os.write(1, b"FEngine (64 bits) created at 0x1 (threading is enabled)\nmore than chatter\n")
        os.write(2, b"a real problem\n")
    assert capfd.readouterr() == ("more than chatter\n", "a real problem\n")
    assert chatter == ["FEngine (64 bits) created at 0x1 (threading is enabled)"]


def test_a_stack_trace_of_a_full_arena_is_filtered_for_every_caller(capfd: pytest.CaptureFixture[str]) -> None:
    lines = (
        "HandleAllocator arena is full, using slower system heap.",
        "#0\t_render_filament.so  0x7f0 operator() + 1",
        "#13\tlibpython3.11.so.1.0                0x7f36b9b58ba3 PyObject_Vectorcall + 51",
    )
    with native_output() as chatter:
        os.write(2, "\n".join((*lines, "#13 of 20 is missing", "")).encode())
    assert capfd.readouterr() == ("", "#13 of 20 is missing\n") and chatter == list(lines)


def test_output_comes_back_after_an_exception(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(RuntimeError), native_output():
        os.write(2, b"last words\n")
        raise RuntimeError
    os.write(1, b"alive\n")
    assert capfd.readouterr() == ("alive\n", "last words\n")


@pytest.mark.parametrize("quiet", [True, False], ids=["caught", "not caught"])
def test_what_c_keeps_in_its_buffers_is_caught_too(quiet: bool) -> None:
    """Into a pipe C prints late: after the block, past the one who reads a command's JSON, unless it is made to."""
    code = (
        "import contextlib, ctypes\n"
        "from gear.render.native_output import native_output\n"
        f"with native_output() if {quiet} else contextlib.nullcontext([]) as chatter:\n"
        "    ctypes.CDLL(None).puts(b'Backend feature level: 3')\n"
        "print(chatter)\n"
    )
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    expected = ["['Backend feature level: 3']"] if quiet else ["[]", "Backend feature level: 3"]
    assert done.stdout.splitlines() == expected


def test_the_doctor_prints_json_alone_into_a_pipe() -> None:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    code = "from gear.cli.main import main; main(['doctor', '--renderer', 'filament', '--json'])"
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["renderers"]["filament"]["driver"] != "unknown", "Filament's words came too late"
