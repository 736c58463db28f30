"""gear's own physically based OpenGL renderer: its pictures of streets look like those of Filament and take a fraction
of the time.

Filament shades every sample with one general shader that is compiled into MuJoCo. This renderer has a shader for each
kind of material. It draws ids and depth first, so that hidden surfaces are not shaded, draws the shadows of static
objects only once, and sums light in 16 bits instead of eight.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from gear.contracts.rendering import Quality
from gear.render.glcontext import backend_setting, choose_backend, egl_problem, open_context
from gear.values.array_shelf import NO_SHELF, ArrayShelf
from gear.values.errors import BackendError

if TYPE_CHECKING:
    import mujoco

    from gear.render.raster.renderer import RasterRenderer

__all__ = ["open_raster"]

_OTHERS = "use --renderer filament or classic"


def open_raster(model: mujoco.MjModel, *, quality: Quality = "film", shelf: ArrayShelf = NO_SHELF) -> RasterRenderer:
    """Makes a renderer for one model, in an OpenGL context of its own.

    Args:
        model: the compiled world; it is not changed.
        quality: `film` takes several samples per pixel; `fast` takes one and smooths edges.
        shelf: shelf of this model, for its triangles and the shadow map of its static geoms.

    Raises:
        BackendError: EGL has no driver for OpenGL 4.5; the message names the setting or the missing package.
    """
    backend = choose_backend("raster")
    if backend != "egl":
        # PyOpenGL finds functions of OSMesa by the symbols of its library, which end with OpenGL 1.3.
        setting = backend_setting()
        if setting is not None:
            problem = f"it needs EGL, and {setting} is {os.environ[setting]}"
            raise BackendError("raster", problem, f"unset {setting}, or {_OTHERS}")
        problem, remedy = egl_problem() or ("it needs EGL, and this process uses OSMesa", "start a new process")
        raise BackendError("raster", problem, f"{remedy}, or {_OTHERS}")
    context = open_context(backend, "raster")
    try:
        # PyOpenGL keeps the platform that is set at its first import, so it is imported after the context is opened.
        from gear.render.raster.renderer import RasterRenderer

        return RasterRenderer(model, context, quality=quality, shelf=shelf)
    except BaseException:
        context.free()
        raise
