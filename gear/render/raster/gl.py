"""Wrappers for the parts of OpenGL 4.5 that this renderer uses: programs, buffers, render targets, textures."""

from __future__ import annotations

import ctypes
import re
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np
import numpy.typing as npt
from OpenGL import GL  # type: ignore[import-untyped]

from gear.values.errors import BackendError

_VERSION = "#version 450 core\n"
_LEAST = (4, 5)

PIECES = 800
"""Largest number of pieces of geometry in one draw call: uniform blocks have at least 64 KiB on all desktop drivers."""

_HEAD_OF_GEOMS = f"#extension GL_ARB_shader_draw_parameters : require\n#define PIECES {PIECES}\n"
_OF_GEOMS = ("positions.vert", "surface.vert")
_REMEDY = "update the driver, or use --renderer filament"


def require_version() -> None:
    """Checks that the current context has OpenGL 4.5.

    Raises:
        BackendError: the context has a lower version; the message names this version.
    """
    words = _text(GL.glGetString(GL.GL_VERSION))
    found = re.match(r"(\d+)\.(\d+)", words)
    if not found or (int(found[1]), int(found[2])) < _LEAST:
        raise BackendError("raster", f"it needs OpenGL {_LEAST[0]}.{_LEAST[1]}, and the driver has {words}", _REMEDY)


class Program:
    """A compiled and linked pair of a vertex and a fragment shader."""

    def __init__(self, vertex: str, fragment: str, flags: tuple[str, ...] = ()) -> None:
        """Compiles two shaders of this folder. The source of `frame.glsl` is put before each shader, and that of
        `pose.glsl` before shaders that draw geoms.

        Args:
            vertex, fragment: names of the files, without `.glsl`.
            flags: preprocessor definitions for both shaders, such as `SHADOWS` or `LIGHTS 2`.

        Raises:
            BackendError: a shader does not compile; the message is the driver's.
        """
        self.handle = GL.glCreateProgram()
        head = "".join(f"#define {flag}\n" for flag in flags) + _source("frame")
        for kind, name in ((GL.GL_VERTEX_SHADER, vertex), (GL.GL_FRAGMENT_SHADER, fragment)):
            shader = GL.glCreateShader(kind)
            first, pose = (_HEAD_OF_GEOMS, _source("pose")) if name in _OF_GEOMS else ("", "")
            GL.glShaderSource(shader, _VERSION + first + head + pose + _source(name))
            GL.glCompileShader(shader)
            if not GL.glGetShaderiv(shader, GL.GL_COMPILE_STATUS):
                raise BackendError("raster", f"{name}.glsl: {_text(GL.glGetShaderInfoLog(shader))}", _REMEDY)
            GL.glAttachShader(self.handle, shader)
            GL.glDeleteShader(shader)
        GL.glLinkProgram(self.handle)
        if not GL.glGetProgramiv(self.handle, GL.GL_LINK_STATUS):
            said = _text(GL.glGetProgramInfoLog(self.handle))
            raise BackendError("raster", f"{vertex}.glsl with {fragment}.glsl: {said}", _REMEDY)

    def use(self, **matrices: npt.NDArray[np.float64]) -> None:
        """Makes the shader program current and sets its uniform variables.

        Args:
            **matrices: values by name of the uniform: (4, 4) or (3, 3) matrices, or vectors of four numbers.
        """
        GL.glUseProgram(self.handle)
        for name, matrix in matrices.items():
            place = GL.glGetUniformLocation(self.handle, name)
            values = np.ascontiguousarray(matrix, np.float32)
            if matrix.shape == (4, 4):
                GL.glUniformMatrix4fv(place, 1, True, values)
            elif matrix.shape == (3, 3):
                GL.glUniformMatrix3fv(place, 1, True, values)
            else:
                GL.glUniform4fv(place, 1, values)


def static_buffer(content: npt.NDArray[Any]) -> int:
    """Makes an OpenGL buffer with constant content. Returns its OpenGL name.

    Args:
        content: array of any dtype, whose bytes are copied to the graphics device; it may be empty.
    """
    buffer = np.zeros(1, np.uint32)
    GL.glCreateBuffers(1, buffer)
    if content.nbytes:
        GL.glNamedBufferStorage(int(buffer[0]), content.nbytes, np.ascontiguousarray(content), 0)
    return int(buffer[0])


class StreamBuffer:
    """An OpenGL buffer for content that changes from frame to frame; `upload` replaces all of it."""

    def __init__(self, target: int) -> None:
        """Makes an empty buffer in the current context.

        Args:
            target: OpenGL's binding point, such as `GL.GL_ARRAY_BUFFER`.
        """
        self._target = target
        buffer = np.zeros(1, np.uint32)
        GL.glCreateBuffers(1, buffer)
        self.handle = int(buffer[0])

    def upload(self, content: npt.NDArray[Any]) -> None:
        """Binds the buffer and replaces its content.

        Args:
            content: array of any dtype, whose bytes become the content.
        """
        GL.glBindBuffer(self._target, self.handle)
        GL.glBufferData(self._target, content.nbytes, np.ascontiguousarray(content), GL.GL_STREAM_DRAW)


def draw_elements(counts: npt.NDArray[np.int32], firsts: npt.NDArray[np.int64], bases: npt.NDArray[np.int32]) -> None:
    """Draws runs of triangles from the current buffer of 32-bit indices; shaders know the number of each run.

    Args:
        counts: (N,) number of indices of each run.
        firsts: (N,) first index of each run.
        bases: (N,) number that is added to the indices of each run.
    """
    offsets = (ctypes.c_void_p * len(firsts))(*(4 * firsts).tolist())
    GL.glMultiDrawElementsBaseVertex(
        GL.GL_TRIANGLES,
        np.ascontiguousarray(counts),
        GL.GL_UNSIGNED_INT,
        offsets,
        len(counts),
        np.ascontiguousarray(bases),
    )


@dataclass(frozen=True, slots=True)
class RenderTarget:
    """A framebuffer with a colour (or id) texture and a depth texture.

    Attributes:
        handle, colour, depth: OpenGL names of the framebuffer and of its textures; 0 for a missing texture.
        width, height: size in pixels.
    """

    handle: int
    colour: int
    depth: int
    width: int
    height: int

    @staticmethod
    def create(width: int, height: int, colour_format: int | None, depth: int | None = None) -> RenderTarget:
        """Makes a render target of `width` x `height` pixels.

        Args:
            width: pixels.
            height: pixels.
            colour_format: OpenGL's internal format of the colour texture; None for no colour.
            depth: OpenGL name of a depth texture to share; 0 for no depth; None for a new 32-bit depth texture.
        """
        frame = np.zeros(1, np.uint32)
        GL.glCreateFramebuffers(1, frame)
        handle = int(frame[0])
        colour = 0
        if colour_format is not None:
            colour = plain_texture(width, height, colour_format)
            GL.glNamedFramebufferTexture(handle, GL.GL_COLOR_ATTACHMENT0, colour, 0)
        if depth is None:
            depth = plain_texture(width, height, GL.GL_DEPTH_COMPONENT32F)
        if depth:
            GL.glNamedFramebufferTexture(handle, GL.GL_DEPTH_ATTACHMENT, depth, 0)
        return RenderTarget(handle, colour, depth, width, height)

    def bind(self, part: tuple[int, int, int, int] | None = None) -> None:
        """Makes the target current and sets viewport and scissors.

        Args:
            part: left, top, width and height in pixels of the part to draw into; None for the whole target.
        """
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self.handle)
        rectangle = part or (0, 0, self.width, self.height)
        GL.glViewport(*rectangle)
        GL.glScissor(*rectangle)

    def read_depth(self, part: tuple[int, int, int, int]) -> npt.NDArray[np.float32]:
        """The depth of a part of the target, which must be current: (height, width) float32, 0..1.

        Args:
            part: left, top, width and height in pixels.
        """
        depth = np.empty((part[3], part[2]), np.float32)
        GL.glReadPixels(*part, GL.GL_DEPTH_COMPONENT, GL.GL_FLOAT, depth)
        return depth


def upload_texture(content: npt.NDArray[np.uint8], *, is_srgb: bool) -> int:
    """Uploads a 2D texture with mip levels. The texture repeats and is filtered trilinearly.

    Args:
        content: (H, W, C) uint8 with one to four channels; one channel is read as grey.
        is_srgb: whether the bytes are sRGB-encoded.

    Returns:
        OpenGL name of the texture.
    """
    height, width, channels = content.shape
    texture = _texture(GL.GL_TEXTURE_2D)
    levels = max(height, width).bit_length()
    GL.glTextureStorage2D(texture, levels, GL.GL_SRGB8_ALPHA8 if is_srgb else GL.GL_RGBA8, width, height)
    GL.glPixelStorei(GL.GL_UNPACK_ALIGNMENT, 1)
    kind = {1: GL.GL_RED, 2: GL.GL_RG, 3: GL.GL_RGB, 4: GL.GL_RGBA}[channels]
    GL.glTextureSubImage2D(
        texture, 0, 0, 0, width, height, kind, GL.GL_UNSIGNED_BYTE, np.ascontiguousarray(content).reshape(-1)
    )
    if channels == 1:
        for swizzle in (GL.GL_TEXTURE_SWIZZLE_G, GL.GL_TEXTURE_SWIZZLE_B):
            GL.glTextureParameteri(texture, swizzle, GL.GL_RED)
    GL.glTextureParameteri(texture, GL.GL_TEXTURE_MIN_FILTER, GL.GL_LINEAR_MIPMAP_LINEAR)
    GL.glGenerateTextureMipmap(texture)
    return texture


def upload_cubemap(levels: tuple[npt.NDArray[Any], ...]) -> int:
    """Uploads a cube map from its mip levels, each of (6, n, n, 3) linear floats. Returns its OpenGL name.

    Args:
        levels: mip levels, finest first; faces in the order +x, -x, +y, -y, +z, -z.
    """
    texture = _texture(GL.GL_TEXTURE_CUBE_MAP)
    size = levels[0].shape[1]
    GL.glTextureStorage2D(texture, len(levels), GL.GL_RGBA16F, size, size)
    for level, faces in enumerate(levels):
        side = faces.shape[1]
        content = np.ascontiguousarray(faces, np.float32)
        GL.glTextureSubImage3D(texture, level, 0, 0, 0, side, side, 6, GL.GL_RGB, GL.GL_FLOAT, content)
    smooth = GL.GL_LINEAR_MIPMAP_LINEAR if len(levels) > 1 else GL.GL_LINEAR
    GL.glTextureParameteri(texture, GL.GL_TEXTURE_MIN_FILTER, smooth)
    return texture


def upload_table(content: npt.NDArray[Any]) -> int:
    """Uploads a lookup table of (H, W, 2) floats, which is filtered bilinearly and clamped at its borders. Returns
    its OpenGL name.

    Args:
        content: (H, W, 2) values.
    """
    height, width = content.shape[:2]
    texture = _texture(GL.GL_TEXTURE_2D)
    GL.glTextureStorage2D(texture, 1, GL.GL_RG16F, width, height)
    values = np.ascontiguousarray(content, np.float32)
    GL.glTextureSubImage2D(texture, 0, 0, 0, width, height, GL.GL_RG, GL.GL_FLOAT, values)
    for name, value in (
        (GL.GL_TEXTURE_MIN_FILTER, GL.GL_LINEAR),
        (GL.GL_TEXTURE_WRAP_S, GL.GL_CLAMP_TO_EDGE),
        (GL.GL_TEXTURE_WRAP_T, GL.GL_CLAMP_TO_EDGE),
    ):
        GL.glTextureParameteri(texture, name, value)
    return texture


def shadow_map(width: int, height: int) -> int:
    """Makes a depth texture with comparison for shadows. Returns its OpenGL name.

    A read in a shader returns the lit share 0..1, and 1 outside the borders.

    Args:
        width, height: size in texels.
    """
    texture = _texture(GL.GL_TEXTURE_2D)
    GL.glTextureStorage2D(texture, 1, GL.GL_DEPTH_COMPONENT32F, width, height)
    for name, value in (
        (GL.GL_TEXTURE_MIN_FILTER, GL.GL_LINEAR),
        (GL.GL_TEXTURE_MAG_FILTER, GL.GL_LINEAR),
        (GL.GL_TEXTURE_WRAP_S, GL.GL_CLAMP_TO_BORDER),
        (GL.GL_TEXTURE_WRAP_T, GL.GL_CLAMP_TO_BORDER),
        (GL.GL_TEXTURE_COMPARE_MODE, GL.GL_COMPARE_REF_TO_TEXTURE),
        (GL.GL_TEXTURE_COMPARE_FUNC, GL.GL_LEQUAL),
    ):
        GL.glTextureParameteri(texture, name, value)
    GL.glTextureParameterfv(texture, GL.GL_TEXTURE_BORDER_COLOR, np.ones(4, np.float32))
    return texture


def upload_depth(texture: int, left: int, top: int, depth: npt.NDArray[np.float32]) -> None:
    """Replaces a part of a depth texture.

    Args:
        texture: OpenGL name of the texture.
        left, top: first column and row of the part, pixels.
        depth: (height, width) float32 values 0..1.
    """
    height, width = depth.shape
    GL.glTextureSubImage2D(texture, 0, left, top, width, height, GL.GL_DEPTH_COMPONENT, GL.GL_FLOAT, depth)


def free_textures(textures: list[int]) -> None:
    """Frees textures, given by their OpenGL names.

    Args:
        textures: OpenGL names, as the functions that upload textures return them.
    """
    GL.glDeleteTextures(len(textures), np.array(textures, np.uint32))


def plain_texture(width: int, height: int, kept_as: int) -> int:
    """Makes a texture without mip levels, which is read without filtering. Returns its OpenGL name.

    Args:
        width, height: size in pixels.
        kept_as: OpenGL's internal format.
    """
    texture = _texture(GL.GL_TEXTURE_2D)
    GL.glTextureStorage2D(texture, 1, kept_as, width, height)
    for name in (GL.GL_TEXTURE_MIN_FILTER, GL.GL_TEXTURE_MAG_FILTER):
        GL.glTextureParameteri(texture, name, GL.GL_NEAREST)
    return texture


def _texture(kind: int) -> int:
    texture = np.zeros(1, np.uint32)
    GL.glCreateTextures(kind, 1, texture)
    return int(texture[0])


def _source(name: str) -> str:
    return files("gear.render.raster").joinpath(f"{name}.glsl").read_text("utf-8")


def _text(log: bytes | str) -> str:
    return log.decode("utf-8", "replace").strip() if isinstance(log, bytes) else log.strip()
