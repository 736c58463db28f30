"""Opens an OpenGL context without a window: through EGL if it works, otherwise through OSMesa.

If no context can be opened, the error names the cause: an environment variable, or a missing package.
"""

from __future__ import annotations

import ctypes
import os
from typing import Any

from gear.values.errors import BackendError

_NO_LIBRARY = "apt-get install libegl1 libopengl0 libegl-mesa0 libgl1-mesa-dri"
_NO_VENDOR = "apt-get install libegl-mesa0 libgl1-mesa-dri (or, for a GPU, its vendor's driver, such as libnvidia-gl)"
_NO_DRIVER = "apt-get install libgl1-mesa-dri (or, for a GPU, its vendor's driver, such as libnvidia-gl)"
_OSMESA = "apt-get install libosmesa6, or use EGL"
_OSMESA_LIBRARIES = ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")
_PLATFORM_DEVICE = 0x313F
_MAX_DEVICES = 32
_DEVICE = "MUJOCO_EGL_DEVICE_ID"
_PLATFORM = "PYOPENGL_PLATFORM"
_SETTINGS = ("MUJOCO_GL", _PLATFORM)


def backend_setting() -> str | None:
    """Name of the environment variable that selects EGL or OSMesa in this process; None if no variable does.

    On its first use, PyOpenGL binds the process to one platform until the process ends, and sets `PYOPENGL_PLATFORM`.
    """
    for name in _SETTINGS:
        if os.environ.get(name, "").strip().lower() in ("egl", "osmesa"):
            return name
    return None


def choose_backend(renderer: str) -> str:
    """Chooses `egl` or `osmesa`: the backend that an environment variable selects, otherwise the first backend that
    works on this machine.

    Args:
        renderer: name of the renderer that needs a context, for error messages.

    Raises:
        BackendError: no backend works; the message says what to install.
    """
    setting = backend_setting()
    if setting is not None:
        return os.environ[setting].strip().lower()
    problem = egl_problem()
    if problem is None:
        return "egl"
    if any(map(_loads, _OSMESA_LIBRARIES)):
        return "osmesa"
    raise BackendError(renderer, f"{problem[0]}, and OSMesa is not installed", problem[1])


def open_context(backend: str, renderer: str) -> Any:
    """Opens an OpenGL context (MuJoCo's own `GLContext`) and makes it current.

    Args:
        backend: `egl` or `osmesa`.
        renderer: name of the renderer that needs the context, for error messages.

    Raises:
        BackendError: the driver is missing, or `MUJOCO_EGL_DEVICE_ID` is not the number of a device.
    """
    _silence_mesa()
    try:
        if backend == "egl":
            from mujoco.egl import GLContext
        else:
            from mujoco.osmesa import GLContext
        context = GLContext(1, 1)
        context.make_current()
    # PyOpenGL reports a missing library in many ways, AttributeError among them.
    except Exception as error:
        problem, remedy = _cause(backend, error)
        raise BackendError(renderer, problem, remedy) from error
    return context


def _cause(backend: str, error: Exception) -> tuple[str, str]:
    """Why a context could not be opened, and what to do."""
    text = str(error).splitlines()[0] if str(error) else type(error).__name__
    platform = os.environ.get(_PLATFORM, "")
    if platform not in ("", "egl", "osmesa"):
        return f"{_PLATFORM} is {platform[:40]!r}, and gear renders through EGL or OSMesa", f"unset {_PLATFORM}"
    if backend != "egl":
        return f"OSMesa does not start ({text})", _OSMESA
    found = egl_problem()
    if found is not None:
        return found
    number = os.environ.get(_DEVICE)
    if number is not None and (_DEVICE in str(error) or not number.strip().lstrip("+-").isdigit()):
        last = len(_egl_devices() or ()) - 1
        return (
            f"{_DEVICE} is {number[:40]!r}, and EGL has the devices 0 to {last}",
            "set it to one of them, or unset it",
        )
    return f"EGL does not start ({text})", _NO_DRIVER


def egl_problem() -> tuple[str, str] | None:
    """The reason why EGL cannot be used without a display, and what to install; None if EGL can start a device."""
    _silence_mesa()
    if not _loads("libEGL.so.1"):
        return "the EGL library libEGL.so.1 is not installed", _NO_LIBRARY
    devices = _egl_devices()
    if not devices:
        return "EGL finds no driver", _remedy(_NO_VENDOR, "__EGL_VENDOR_LIBRARY_DIRS", "__EGL_VENDOR_LIBRARY_FILENAMES")
    if not any(map(_initialises, devices)):
        return "EGL finds a device, but no driver for it starts", _remedy(_NO_DRIVER, "LIBGL_DRIVERS_PATH")
    return None


def _silence_mesa() -> None:
    """Switches off warnings that Mesa's EGL writes to stderr, because gear reports the cause in its own line."""
    os.environ.setdefault("EGL_LOG_LEVEL", "fatal")


def _remedy(install: str, *settings: str) -> str:
    """What to install. If settings of the environment hide what is installed, the text first says which ones to
    unset.
    """
    found = [name for name in settings if os.environ.get(name)]
    return f"unset {' and '.join(found)}, or {install}" if found else install


def driver_and_device() -> tuple[str, str]:
    """The name of the current OpenGL context's driver (with version), and the name of its device."""
    from OpenGL import GL  # type: ignore[import-untyped]

    version, device = GL.glGetString(GL.GL_VERSION), GL.glGetString(GL.GL_RENDERER)
    return version.decode("utf-8", "replace"), device.decode("utf-8", "replace")


def is_software(device: str) -> bool:
    """Whether the name of a device belongs to a driver of Mesa that renders on the CPU.

    Args:
        device: name that OpenGL reports (`GL_RENDERER`).
    """
    return any(word in device.casefold() for word in ("llvmpipe", "softpipe", "swrast", "software"))


def _loads(library: str) -> bool:
    """Whether a shared library is installed."""
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _egl_devices() -> list[int]:
    """Handles of EGL's devices; empty if EGL cannot list devices."""
    library = ctypes.CDLL("libEGL.so.1")
    library.eglGetProcAddress.restype = ctypes.c_void_p
    query = library.eglGetProcAddress(b"eglQueryDevicesEXT")
    if not query:
        return []
    devices = (ctypes.c_void_p * _MAX_DEVICES)()
    count = ctypes.c_int32()
    query_devices = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p)(query)
    query_devices(_MAX_DEVICES, devices, ctypes.byref(count))
    return [handle for handle in devices[: count.value] if handle]


def _initialises(device: int) -> bool:
    """Whether a device's driver starts without a display."""
    library = ctypes.CDLL("libEGL.so.1")
    library.eglGetProcAddress.restype = ctypes.c_void_p
    get_display = library.eglGetProcAddress(b"eglGetPlatformDisplayEXT")
    if not get_display:
        return False
    platform_display = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p)(get_display)
    library.eglInitialize.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p)
    display = platform_display(_PLATFORM_DEVICE, device, None)
    return bool(display and library.eglInitialize(display, None, None))
