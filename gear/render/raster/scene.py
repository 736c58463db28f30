"""A model on the device: its triangles, pictures and lights, and how parts of it are drawn."""

from __future__ import annotations

import ctypes

import mujoco
import numpy as np
import numpy.typing as npt
from OpenGL import GL  # type: ignore[import-untyped]

from gear.contracts.rendering import Stage
from gear.render.culling import Mask
from gear.render.raster import gl
from gear.render.raster.geometry import COMMAND, VERTEX, Geometry, geometry_of
from gear.render.raster.lights import MOST_LIGHTS, Environment, Lamps, environment_of
from gear.render.raster.materials import ROLES, looks_of
from gear.render.raster.shadow_squares import Maps
from gear.render.raster.split_sum import mirrored_shares
from gear.render.raster.textures import Pictures, linear_cubes, sky_of
from gear.values.geometry import Array

Selection = npt.NDArray[np.intp]

_SEEN_GROUPS, _LANDMARKS = 3, 8
_MIRRORED_UNIT, _SHARES_UNIT = 5, 7
_GEOM = np.dtype([("camera_from_geom", "<f4", (3, 4)), ("colour", "<f4", 4), ("surface", "<f4", 4)])
_FRAME = np.dtype(
    [
        ("sun_axes", "<f4", (3, 4)),
        ("shadow_scale", "<f4", (3, 4)),
        ("shadow_offset", "<f4", (3, 4)),
        ("shadow_end", "<f4", 4),
        ("irradiance", "<f4", (4, 4)),
        ("towards_light", "<f4", (MOST_LIGHTS, 4)),
        ("light", "<f4", (MOST_LIGHTS, 4)),
        ("environment", "<f4", 4),
    ]
)


class Scene:
    """What of a model lies on the device of the current context."""

    def __init__(self, model: mujoco.MjModel) -> None:
        """Uploads a model."""
        self._looks = looks_of(model)
        drawn = (model.geom_group < _SEEN_GROUPS) & ~self._looks.is_clear
        geometry = geometry_of(model, drawn)
        self._commands = geometry.commands
        self.geom_of_piece = geometry.geoms
        self._spheres = geometry.centres_m, geometry.radii_m
        self._vertex_array = _vertex_array(geometry)
        GL.glBindVertexArray(self._vertex_array)
        self._landmarks_m = _landmarks(geometry)
        self._pictures = Pictures(model, np.unique(self._looks.textures[drawn]).tolist())
        self._batch_of_geom = np.unique(self._looks.textures, axis=0, return_inverse=True)[1].reshape(-1)
        self._face_of_geom: dict[int, int] = {}
        cubes = linear_cubes(model)
        self._environment: Environment = environment_of(model, cubes)
        self._mirrored = gl.cube(self._environment.levels or (np.zeros((6, 1, 1, 3)),))
        self._shares = gl.table(mirrored_shares())
        sky = sky_of(model)
        self.sky = 0 if sky is None or sky not in cubes else gl.cube((cubes[sky],))
        self._geoms = gl.Stream(GL.GL_SHADER_STORAGE_BUFFER)
        self._frame = gl.Stream(GL.GL_UNIFORM_BUFFER)
        self._draws = gl.Stream(GL.GL_DRAW_INDIRECT_BUFFER)
        self._surfaces: dict[tuple[str, ...], gl.Program] = {}
        self._light_flags: tuple[str, ...] = ("LIGHTS 0",)

    def dress(self, stage: Stage) -> None:
        """Puts faces on, and takes off those of the last stage."""
        self._face_of_geom = self._pictures.faces(stage.faces)

    def pose(self, stage: Stage, camera_m: Array) -> None:
        """Puts everything where the stage has it, in its colours, seen from a place in the world."""
        geoms = np.zeros(stage.model.ngeom, _GEOM)
        geoms["camera_from_geom"][..., :3] = stage.data.geom_xmat.reshape(-1, 3, 3)
        geoms["camera_from_geom"][..., 3] = stage.data.geom_xpos - camera_m
        geoms["colour"][:, :3] = self._looks.albedo
        geoms["surface"] = self._looks.surface
        for geom, rgb in stage.paint_rgb.items():
            geoms["colour"][geom, :3] = rgb
        for geom in stage.faces:
            geoms["colour"][geom, :3] = 1.0
        self._geoms.fill(geoms)
        GL.glBindBufferBase(GL.GL_SHADER_STORAGE_BUFFER, 0, self._geoms.handle)

    def light(self, lamps: Lamps, maps: Maps | None, camera_m: Array) -> None:
        """Lights it for a camera.

        Args:
            lamps: all lights but the sky.
            maps: of the first lamp's shadows, if it throws any.
            camera_m: (3,) where the camera stands in the world.
        """
        frame = np.zeros(1, _FRAME)
        if maps is not None:
            frame["sun_axes"][0, :, :3] = maps.axes
            frame["shadow_scale"][0, :, :3] = maps.scale
            frame["shadow_scale"][0, :, 3] = maps.texel_m
            frame["shadow_offset"][0, :, :3] = maps.offset
            frame["shadow_end"][0, :3] = (*maps.end_m, maps.town_ends)
        frame["irradiance"][0, :, :3] = self._environment.irradiance
        count = len(lamps.light)
        frame["towards_light"][0, :count] = lamps.towards
        frame["towards_light"][0, :count, :3] -= lamps.towards[:, 3:] * camera_m
        frame["light"][0, :count, :3] = lamps.light
        frame["environment"][0, 0] = max(len(self._environment.levels) - 1, 0)
        self._frame.fill(frame)
        GL.glBindBufferBase(GL.GL_UNIFORM_BUFFER, 0, self._frame.handle)
        GL.glBindTextureUnit(_MIRRORED_UNIT, self._mirrored)
        GL.glBindTextureUnit(_SHARES_UNIT, self._shares)
        self._light_flags = (f"LIGHTS {count}", *(("SHADOWS",) if maps is not None else ()))

    def spheres(self, stage: Stage) -> tuple[Array, Array]:
        """(P, 3) centres in the world and (P,) radii in metres of spheres about the pieces that geoms are drawn in."""
        centres_m, radii_m = self._spheres
        turns = stage.data.geom_xmat.reshape(-1, 3, 3)[self.geom_of_piece]
        return np.einsum("pij,pj->pi", turns, centres_m) + stage.data.geom_xpos[self.geom_of_piece], radii_m

    def landmarks(self, stage: Stage, chosen: Mask) -> Array:
        """(N, 3) places in the world of some vertices of the chosen pieces; the origin for none."""
        marks_m = self._landmarks_m[chosen]
        geoms = self.geom_of_piece[chosen]
        turns = stage.data.geom_xmat.reshape(-1, 3, 3)[geoms]
        places = np.einsum("pij,pkj->pki", turns, marks_m) + stage.data.geom_xpos[geoms][:, None]
        return np.concatenate([places.reshape(-1, 3), np.zeros((int(len(geoms) == 0), 3))])

    def draw(self, selection: Selection) -> None:
        """Draws pieces with the current program, as shapes alone, in this order."""
        self._submit([(selection, None)])

    def draw_surfaces(self, selection: Selection, matrix: Array, flags: tuple[str, ...]) -> None:
        """Draws pieces as they look.

        Args:
            selection: which, in this order within each kind of material.
            matrix: (4, 4) to the picture from places relative to the camera.
            flags: for all of the shaders.
        """
        geoms = self.geom_of_piece[selection]
        # What wears a face is a kind of its own.
        kinds = np.where(np.isin(geoms, list(self._face_of_geom)), -1 - geoms, self._batch_of_geom[geoms])
        groups = [selection[kinds == kind] for kind in dict.fromkeys(kinds.tolist())]
        self._submit([(group, (matrix, flags)) for group in groups])

    def _submit(self, groups: list[tuple[Selection, tuple[Array, tuple[str, ...]] | None]]) -> None:
        """One draw a group, out of one buffer of commands."""
        if not any(len(group) for group, _ in groups):
            return
        self._draws.fill(self._commands[np.concatenate([group for group, _ in groups])])
        begin = 0
        for group, look in groups:
            if look is not None:
                self._wear(int(self.geom_of_piece[group[0]]), *look)
            offset = ctypes.c_void_p(begin * COMMAND.itemsize)
            GL.glMultiDrawElementsIndirect(GL.GL_TRIANGLES, GL.GL_UNSIGNED_INT, offset, len(group), COMMAND.itemsize)
            begin += len(group)

    def _wear(self, geom: int, matrix: Array, flags: tuple[str, ...]) -> None:
        """Makes the program and the pictures of a geom's material current."""
        pictures = [self._pictures.of(texture) for texture in self._looks.textures[geom].tolist()]
        pictures[0] = self._face_of_geom.get(geom, pictures[0])
        for unit, picture in enumerate(pictures):
            if picture:
                GL.glBindTextureUnit(unit, picture)
        key = (*(flag for flag, picture in zip(ROLES, pictures, strict=True) if picture), *self._light_flags, *flags)
        if key not in self._surfaces:
            self._surfaces[key] = gl.Program("surface.vert", "surface.frag", key)
        self._surfaces[key].use(clip_from_place=matrix)


def _landmarks(geometry: Geometry) -> Array:
    """(P, `_LANDMARKS`, 3) some vertices of each piece, in the frame of its geom."""
    command = geometry.commands
    shares = np.linspace(0, 1, _LANDMARKS)
    chosen = command["first"][:, None] + ((command["count"][:, None] - 1) * shares).astype(np.int64)
    vertices = command["base"][:, None].astype(np.int64) + geometry.indices[chosen]
    return np.asarray(geometry.vertices["position_m"][vertices].astype(np.float64))


def _vertex_array(geometry: Geometry) -> int:
    """Vertices with their indices, and, once a draw, which piece of which geom it is."""
    pieces = np.stack([np.arange(len(geometry.geoms)), geometry.geoms], axis=1).astype(np.uint32)
    array = np.zeros(1, np.uint32)
    GL.glCreateVertexArrays(1, array)
    handle = int(array[0])
    GL.glVertexArrayVertexBuffer(handle, 0, gl.buffer_of(geometry.vertices), 0, VERTEX.itemsize)
    GL.glVertexArrayVertexBuffer(handle, 1, gl.buffer_of(pieces), 0, 8)
    GL.glVertexArrayElementBuffer(handle, gl.buffer_of(geometry.indices))
    for place, (name, count, kind) in enumerate(
        (("position_m", 3, GL.GL_FLOAT), ("normal", 3, GL.GL_SHORT), ("texcoord", 2, GL.GL_FLOAT))
    ):
        _, offset = VERTEX.fields[name][:2]  # type: ignore[index]
        GL.glEnableVertexArrayAttrib(handle, place)
        GL.glVertexArrayAttribFormat(handle, place, count, kind, kind == GL.GL_SHORT, offset)
        GL.glVertexArrayAttribBinding(handle, place, 0)
    for place, offset in ((3, 0), (4, 4)):
        GL.glEnableVertexArrayAttrib(handle, place)
        GL.glVertexArrayAttribIFormat(handle, place, 1, GL.GL_UNSIGNED_INT, offset)
        GL.glVertexArrayAttribBinding(handle, place, 1)
    GL.glVertexArrayBindingDivisor(handle, 1, 1)
    return handle
