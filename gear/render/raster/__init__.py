"""Gear's own physically based renderer, through OpenGL: what Filament shows of a street, for a fraction of the time.

Filament shades every sample with one general shader that comes compiled with MuJoCo. This renderer has a shader for
each kind of material, draws ids and depth first so that no surface is shaded that nobody sees, draws the shadows of
what stands still once, and adds light up in 16 bits instead of eight.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gear.contracts.rendering import Quality
from gear.render.glcontext import choose_backend, open_context
from gear.values.errors import BackendError

if TYPE_CHECKING:
    import mujoco

    from gear.render.raster.renderer import RasterRenderer

__all__ = ["open_raster"]

_REMEDY = "unset MUJOCO_GL and PYOPENGL_PLATFORM, or use --renderer filament or classic"


def open_raster(model: mujoco.MjModel, *, quality: Quality = "film") -> RasterRenderer:
    """The renderer, in a context of its own.

    Raises:
        BackendError: there is no driver of OpenGL 4.5 for EGL.
    """
    backend = choose_backend("raster")
    if backend != "egl":
        # OSMesa's library has no symbols for what is newer than OpenGL 1.3, and PyOpenGL looks for nothing else.
        raise BackendError("raster", f"it needs EGL, and this process uses {backend}", _REMEDY)
    context = open_context(backend, "raster")
    try:
        # PyOpenGL takes whatever platform is chosen when it is imported first: the context's.
        from gear.render.raster.renderer import RasterRenderer

        return RasterRenderer(model, context, quality=quality)
    except BaseException:
        context.free()
        raise
