"""A mask of pixels on the graphics device, and draw calls that cover only the tiles of the picture that it touches."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from OpenGL import GL  # type: ignore[import-untyped]

from gear.render.raster import gl
from gear.render.raster.many_samples import Mask
from gear.values.geometry import Array

TILE_PX = 16
"""Side of a tile in pixels."""


class PixelMask:
    """A mask of pixels that changes from frame to frame: a texture for shaders, and the tiles with chosen pixels.

    A software driver executes a shader for every pixel that a draw call covers, even if the shader discards it. The
    tiles with chosen pixels are about half of a street picture.
    """

    def __init__(self, width: int, height: int) -> None:
        """Makes the texture in the current context; its content is undefined until `upload`.

        Args:
            width: width in pixels.
            height: height in pixels.
        """
        self._size = (width, height)
        self._texture = gl.plain_texture(width, height, GL.GL_R8)
        self._corners = gl.StreamBuffer(GL.GL_ARRAY_BUFFER)
        self._count = 0
        array = np.zeros(1, np.uint32)
        GL.glCreateVertexArrays(1, array)
        self._vertex_array = int(array[0])
        GL.glEnableVertexArrayAttrib(self._vertex_array, 0)
        GL.glVertexArrayAttribFormat(self._vertex_array, 0, 2, GL.GL_FLOAT, False, 0)
        GL.glVertexArrayAttribBinding(self._vertex_array, 0, 0)

    def upload(self, is_chosen: Mask) -> None:
        """Replaces the mask.

        Args:
            is_chosen: (height, width) bool, row 0 first.
        """
        content = np.ascontiguousarray(is_chosen).view(np.uint8) * np.uint8(255)
        GL.glPixelStorei(GL.GL_UNPACK_ALIGNMENT, 1)
        GL.glTextureSubImage2D(self._texture, 0, 0, 0, *self._size, GL.GL_RED, GL.GL_UNSIGNED_BYTE, content)
        corners = tile_corners(is_chosen, TILE_PX).astype(np.float32)
        self._count = len(corners)
        self._corners.upload(corners)
        GL.glVertexArrayVertexBuffer(self._vertex_array, 0, self._corners.handle, 0, corners.itemsize * 2)

    def bind(self, unit: int) -> None:
        """Gives shaders the mask as a texture of one channel, 1 for chosen pixels and 0 for others.

        Args:
            unit: number of the texture unit.
        """
        GL.glBindTextureUnit(unit, self._texture)

    def draw_tiles(self) -> None:
        """Covers the tiles with chosen pixels in the current target, which may have another size, by the current
        program with the vertex shader `tiles.vert`. Depth is 0.
        """
        current = int(GL.glGetIntegerv(GL.GL_VERTEX_ARRAY_BINDING))
        GL.glBindVertexArray(self._vertex_array)
        GL.glDrawArrays(GL.GL_TRIANGLES, 0, self._count)
        GL.glBindVertexArray(current)


def tile_corners(is_chosen: Mask, side_px: int) -> Array:
    """Covers the tiles with chosen pixels by triangles; neighbouring tiles of a row are one rectangle.

    Args:
        is_chosen: (H, W) bool, row 0 on top.
        side_px: side of a tile in pixels; tiles at the right and lower borders may be smaller.

    Returns:
        (6 N, 2) x and y in clip space: -1 to 1, x to the right and y up. Each of the N rectangles has two triangles,
        which face the viewer.
    """
    height, width = is_chosen.shape
    rows, columns = (np.arange(0, length, side_px) for length in (height, width))
    touched = np.logical_or.reduceat(np.logical_or.reduceat(is_chosen, rows, axis=0), columns, axis=1)
    change = np.diff(np.pad(touched, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, first = np.nonzero(change == 1)
    _, last = np.nonzero(change == -1)
    left, right = (2 * np.minimum(side_px * tile, width) / width - 1 for tile in (first, last))
    top, bottom = (1 - 2 * np.minimum(side_px * tile, height) / height for tile in (row, row + 1))
    x: npt.NDArray[Any] = np.stack([left, right, right, left, right, left], axis=1)
    y: npt.NDArray[Any] = np.stack([bottom, bottom, top, bottom, top, top], axis=1)
    return np.stack([x, y], axis=2).reshape(-1, 2)
