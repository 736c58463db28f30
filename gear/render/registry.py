"""Finds and opens renderers by name: `raster`, `filament`, `classic`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gear.contracts.rendering import Quality, Renderer
from gear.values.array_shelf import NO_SHELF, ArrayShelf
from gear.values.errors import UnknownNameError

if TYPE_CHECKING:
    import mujoco

RENDERERS = ("raster", "filament", "classic")
"""Names of all renderers; the first one is the default."""

_SUMMARIES = {
    "filament": "physically based, MuJoCo's, through Vulkan: a GPU, or the CPU with Mesa's llvmpipe",
    "raster": "physically based, gear's own, through EGL: what Filament shows, in a quarter of its time on a CPU",
    "classic": "MuJoCo's OpenGL renderer, through EGL or OSMesa: plainer pictures, in the time of raster",
}


def open_renderer(
    name: str, model: mujoco.MjModel, *, quality: Quality = "film", shelf: ArrayShelf = NO_SHELF
) -> Renderer:
    """Opens a renderer for one compiled model. The caller must close the renderer.

    Args:
        name: one of `RENDERERS`.
        model: the compiled world; every stage must be of this model, which is never changed.
        quality: `film` takes several samples per pixel; `fast` takes one and smooths edges.
        shelf: shelf of this model, on which `raster` keeps what it computes when it opens; the other renderers keep
            nothing.

    Raises:
        UnknownNameError: there is no renderer with this name.
        BackendError: the renderer cannot start on this machine; the message says what to install.
    """
    if name == "filament":
        from gear.render.filament import FilamentRenderer

        return FilamentRenderer(model, quality=quality)
    if name == "raster":
        from gear.render.raster import open_raster

        return open_raster(model, quality=quality, shelf=shelf)
    if name == "classic":
        from gear.render.classic import ClassicRenderer

        return ClassicRenderer(model, quality=quality)
    raise UnknownNameError("renderer", name, RENDERERS)


def describe(name: str) -> str:
    """A one-line description of a renderer.

    Args:
        name: one of `RENDERERS`.

    Raises:
        UnknownNameError: there is no renderer with this name.
    """
    if name not in _SUMMARIES:
        raise UnknownNameError("renderer", name, RENDERERS)
    return _SUMMARIES[name]
