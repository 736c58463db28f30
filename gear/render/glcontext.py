"""An OpenGL context without a window: EGL where it works, else OSMesa."""

from __future__ import annotations

import ctypes
import os
from typing import Any

from gear.values.errors import BackendError

_REMEDY = "apt-get install libegl1 libopengl0 libgl1-mesa-dri (or libosmesa6)"
_PLATFORM_DEVICE = 0x313F
_MAX_DEVICES = 32


def choose_backend(renderer: str) -> str:
    """`egl` or `osmesa`: what `MUJOCO_GL` asks for, what this process uses already, or what is there.

    Args:
        renderer: who asks, for the error.

    Raises:
        BackendError: there is neither.
    """
    wish = os.environ.get("MUJOCO_GL", "").strip().lower()
    if wish in ("egl", "osmesa"):
        return wish
    # PyOpenGL binds a process to one platform for good.
    bound = os.environ.get("PYOPENGL_PLATFORM", "").strip().lower()
    if bound in ("egl", "osmesa"):
        return bound
    if _egl_works():
        return "egl"
    if _loads("libOSMesa.so.8") or _loads("libOSMesa.so.6") or _loads("libOSMesa.so"):
        return "osmesa"
    raise BackendError(renderer, "neither EGL nor OSMesa is installed", _REMEDY)


def open_context(backend: str, renderer: str) -> Any:
    """A current GL context of the backend: MuJoCo's own `GLContext`.

    Args:
        backend: `egl` or `osmesa`.
        renderer: who asks, for the error.

    Raises:
        BackendError: the driver is missing.
    """
    try:
        if backend == "egl":
            from mujoco.egl import GLContext
        else:
            from mujoco.osmesa import GLContext
        context = GLContext(1, 1)
        context.make_current()
    # PyOpenGL reports a missing library in many ways, AttributeError among them.
    except Exception as error:
        problem = f"{backend} does not start ({str(error).splitlines()[0] if str(error) else type(error).__name__})"
        raise BackendError(renderer, problem, _REMEDY) from error
    return context


def driver_and_device() -> tuple[str, str]:
    """What the current context's driver and device call themselves."""
    from OpenGL import GL  # type: ignore[import-untyped]

    version, device = GL.glGetString(GL.GL_VERSION), GL.glGetString(GL.GL_RENDERER)
    return version.decode("utf-8", "replace"), device.decode("utf-8", "replace")


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _egl_works() -> bool:
    """Whether EGL finds a device that initialises without a display."""
    try:
        library = ctypes.CDLL("libEGL.so.1")
    except OSError:
        return False
    library.eglGetProcAddress.restype = ctypes.c_void_p
    query = library.eglGetProcAddress(b"eglQueryDevicesEXT")
    get_display = library.eglGetProcAddress(b"eglGetPlatformDisplayEXT")
    if not query or not get_display:
        return False
    devices = (ctypes.c_void_p * _MAX_DEVICES)()
    count = ctypes.c_int32()
    query_devices = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p)(query)
    query_devices(_MAX_DEVICES, devices, ctypes.byref(count))
    platform_display = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p)(get_display)
    library.eglInitialize.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
    for device in devices[: count.value]:
        display = platform_display(_PLATFORM_DEVICE, device, None)
        if display and library.eglInitialize(display, None, None):
            return True
    return False


def is_software(device: str) -> bool:
    """Mesa's CPU drivers by the names they give themselves."""
    return any(word in device.casefold() for word in ("llvmpipe", "softpipe", "swrast", "software"))
