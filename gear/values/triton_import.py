"""Lets Triton be imported after Mesa's OpenGL, which otherwise ends the process with a segmentation fault.

torch from PyPI brings Triton on Linux, and imports it with the first optimiser. Triton's library `libtriton` contains
its own LLVM. Mesa's software driver makes the symbols of another LLVM, `libLLVM`, visible to the whole process, and
`libtriton` would call these. With the flag RTLD_DEEPBIND of dlopen(3), `libtriton` prefers its own symbols.

Renderers load Mesa, and with `MUJOCO_GL=egl` so may MuJoCo alone, before a training, an attack or a worker has opened a
renderer of gear. Therefore the import of gear itself prepares the import of Triton.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.machinery import ExtensionFileLoader, ModuleSpec, PathFinder
from types import ModuleType

LIBRARY = "triton._C.libtriton"
"""The only module that is imported in another way."""


class _DeepBindLoader(ExtensionFileLoader):
    """Loads an extension module that prefers its own symbols to those of libraries that are already loaded."""

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        flags = sys.getdlopenflags()
        sys.setdlopenflags(flags | getattr(os, "RTLD_DEEPBIND", 0))
        try:
            return super().create_module(spec)
        finally:
            sys.setdlopenflags(flags)


class _Finder:
    """Finds `LIBRARY` only."""

    @staticmethod
    def find_spec(name: str, path: Sequence[str] | None = None, target: ModuleType | None = None) -> ModuleSpec | None:
        spec = PathFinder.find_spec(name, path, target) if name == LIBRARY else None
        if spec is not None and isinstance(spec.loader, ExtensionFileLoader):
            spec.loader = _DeepBindLoader(spec.loader.name, spec.loader.path)
        return spec


def bind_triton_to_its_own_symbols() -> None:
    """Makes a later import of Triton in this process safe, whether Mesa is loaded or not; it imports no Triton."""
    if _Finder not in sys.meta_path:
        sys.meta_path.insert(0, _Finder)
