"""Triton after Mesa: which module is loaded in another way, with which flags."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from importlib.machinery import EXTENSION_SUFFIXES, ExtensionFileLoader
from importlib.util import find_spec
from pathlib import Path

import numpy._core._multiarray_umath as extension
import pytest

from gear.values import triton_import

IMPORTED = """
import sys
import mujoco
import gear.networks.network
from gear.values.triton_import import _Finder
assert sys.meta_path[0] is _Finder
assert "gear.render" not in sys.modules
"""

AFTER_MUJOCO = """
import mujoco
context = mujoco.GLContext(1, 1)
context.make_current()
import gear
import triton
"""

AFTER_OPENGL = """
from gear.render.glcontext import choose_backend, open_context
context = open_context(choose_backend("raster"), "raster")
from OpenGL import GL
assert GL.glGetString(GL.GL_RENDERER)
import triton
"""


def test_only_the_library_of_triton_is_loaded_in_another_way(tmp_path: Path) -> None:
    for name in ("libtriton", "other"):
        (tmp_path / f"{name}{EXTENSION_SUFFIXES[0]}").touch()
    finder = triton_import._Finder
    assert finder.find_spec("triton._C.other", [str(tmp_path)]) is None
    assert finder.find_spec(triton_import.LIBRARY, [str(tmp_path / "nowhere")]) is None
    found = finder.find_spec(triton_import.LIBRARY, [str(tmp_path)])
    assert found is not None and isinstance(found.loader, triton_import._DeepBindLoader)


def test_flags_are_restored_when_the_import_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The copied library has no function for a module of this name, so its import fails after it was opened."""
    assert extension.__file__ is not None
    shutil.copy(extension.__file__, tmp_path / f"libtriton{EXTENSION_SUFFIXES[0]}")
    spec = triton_import._Finder.find_spec(triton_import.LIBRARY, [str(tmp_path)])
    assert spec is not None and isinstance(spec.loader, ExtensionFileLoader)
    before, used = sys.getdlopenflags(), list[int]()
    monkeypatch.setattr(sys, "setdlopenflags", used.append)
    with pytest.raises(ImportError):
        spec.loader.create_module(spec)
    assert used == [before | os.RTLD_DEEPBIND, before]


def test_it_is_installed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "meta_path", [one for one in sys.meta_path if one is not triton_import._Finder])
    for _ in range(2):
        triton_import.bind_triton_to_its_own_symbols()
    assert sys.meta_path.count(triton_import._Finder) == 1
    assert sys.meta_path[0] is triton_import._Finder


def run(code: str) -> None:
    """Runs Python code in a process in which the import of MuJoCo loads Mesa."""
    subprocess.run([sys.executable, "-c", code], check=True, env={**os.environ, "MUJOCO_GL": "egl"})


def test_the_import_of_any_module_of_gear_installs_it() -> None:
    """A training whose renderer never starts has it, too."""
    run(IMPORTED)


@pytest.mark.skipif(find_spec("triton") is None, reason="this build of torch comes without Triton")
@pytest.mark.parametrize("code", [AFTER_MUJOCO, AFTER_OPENGL])
def test_triton_can_be_imported_after_mesa(code: str) -> None:
    run(code)
