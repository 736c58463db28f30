"""Tests mirror the tree: every module of gear has a test file of its own, or is imported by one."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]

DRAWN = "it needs a graphics context; tests/render compare the pictures of the renderers"
WITHOUT = {
    "gear.camera.effects.effect": "the base class of effects; tests/camera/effects test every effect through it",
    "gear.render.filament": DRAWN,
    "gear.render.raster.scene": DRAWN,
    "gear.render.raster.sun_shadows": DRAWN,
    "gear.render.raster.textures": DRAWN,
    "gear.world.compilation.compile_worker": "it runs in a subprocess, which the tests of `world_cache` start",
}
"""Modules that no test file is about, with the reason."""


def modules() -> dict[str, Path]:
    """Source files of gear's modules by dotted name, without packages' own files and templates."""
    found = {}
    for path in sorted((ROOT / "gear").rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        if path.name != "__init__.py" and "templates" not in parts:
            found[".".join(parts)] = path
    return found


def imported() -> set[str]:
    """Dotted names that test files import, and the names that they take from them."""
    names: set[str] = set()
    folders = [ROOT / "tests", *(ROOT / "examples").glob("*/tests")]
    for path in (path for folder in folders for path in folder.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                names |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


def mirror_of(module: str) -> Path:
    """The test file in the place that mirrors a module's."""
    *folders, name = module.split(".")[1:]
    return ROOT.joinpath("tests", *folders, f"test_{name}.py")


def test_every_module_has_a_test_file() -> None:
    names = imported()
    missing = [module for module in modules() if module not in names and not mirror_of(module).is_file()]
    assert sorted(missing) == sorted(WITHOUT)


def test_exceptions_exist_and_have_reasons() -> None:
    assert WITHOUT.keys() <= modules().keys()
    assert all(WITHOUT.values())
