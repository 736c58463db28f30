"""A model on the graphics device: triangles, textures and lights, and draw calls for parts of it."""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt
from OpenGL import GL  # type: ignore[import-untyped]

from gear.contracts.rendering import Stage
from gear.render.culling import Mask
from gear.render.raster import gl
from gear.render.raster.geometry import VERTEX, Geometry, shelved_geometry
from gear.render.raster.lights import MAX_LIGHTS, Environment, Lights, environment_of
from gear.render.raster.materials import TEXTURE_ROLES, materials_of
from gear.render.raster.shadow_cascades import ShadowMaps
from gear.render.raster.split_sum import split_sum_table
from gear.render.raster.textures import TextureStore, linear_cubes, sky_of
from gear.values.array_shelf import NO_SHELF, ArrayShelf
from gear.values.geometry import Array

Selection = npt.NDArray[np.intp]

_SEEN_GROUPS, _VERTEX_SAMPLES = 3, 8
_ENVIRONMENT_UNIT, _SPLIT_SUM_UNIT = 5, 7
_VERTICES = 0
_PIECES_BINDING = 1
_PIECE = np.dtype([("camera_from_geom", "<f4", (3, 4)), ("colour", "<f4", 3), ("number", "<i4"), ("surface", "<f4", 4)])
_ALIGNED = 16
"""Number of `_PIECE` records whose size is a multiple of 256 bytes, the largest alignment that drivers ask for."""

_FRAME = np.dtype(
    [
        ("sun_axes", "<f4", (3, 4)),
        ("shadow_scale", "<f4", (3, 4)),
        ("shadow_offset", "<f4", (3, 4)),
        ("shadow_end", "<f4", 4),
        ("irradiance", "<f4", (4, 4)),
        ("towards_light", "<f4", (MAX_LIGHTS, 4)),
        ("light", "<f4", (MAX_LIGHTS, 4)),
        ("environment", "<f4", 4),
    ]
)


class Scene:
    """The triangles, textures and lights of one model in the current OpenGL context."""

    def __init__(self, model: mujoco.MjModel, shelf: ArrayShelf = NO_SHELF) -> None:
        """Uploads a model.

        Args:
            model: the compiled world.
            shelf: shelf of this model, on which its triangles are kept.

        Raises:
            ValueError: a mesh has more than two million vertices.
        """
        self._materials = materials_of(model)
        drawn = (model.geom_group < _SEEN_GROUPS) & ~self._materials.is_invisible
        geometry = shelved_geometry(model, drawn, shelf)
        self._commands = geometry.commands
        self.geom_of_piece = geometry.geoms
        self._spheres = geometry.centres_m, geometry.radii_m
        self._vertex_array = _vertex_array(geometry)
        GL.glBindVertexArray(self._vertex_array)
        self._samples_m = _sample_vertices(geometry)
        self._textures = TextureStore(model, np.unique(self._materials.textures[drawn]).tolist())
        self._batch_of_geom = np.unique(self._materials.textures, axis=0, return_inverse=True)[1].reshape(-1)
        self._face_of_geom: dict[int, int] = {}
        cubes = linear_cubes(model)
        self._environment: Environment = environment_of(model, cubes)
        self._environment_map = gl.upload_cubemap(self._environment.levels or (np.zeros((6, 1, 1, 3)),))
        self._split_sum = gl.upload_table(split_sum_table())
        sky = sky_of(model)
        self.sky = 0 if sky is None or sky not in cubes else gl.upload_cubemap((cubes[sky],))
        self._geoms = np.zeros(model.ngeom, _PIECE)
        self._pieces = gl.StreamBuffer(GL.GL_UNIFORM_BUFFER)
        self._frame = gl.StreamBuffer(GL.GL_UNIFORM_BUFFER)
        self._surfaces: dict[tuple[str, ...], gl.Program] = {}
        self._light_flags: tuple[str, ...] = ("LIGHTS 0",)

    def set_faces(self, stage: Stage) -> None:
        """Uploads the patches of a stage (a posed world), which replace the patches of the previous stage on the
        faces.

        Args:
            stage: the posed world; `Stage.faces` holds the patches.
        """
        self._face_of_geom = self._textures.faces(stage.faces)

    def set_poses(self, stage: Stage, camera_m: Array) -> None:
        """Takes the poses and colours of all geoms of a posed world; the next draw calls use them.

        Args:
            stage: the posed world.
            camera_m: (3,) world position to which all positions are relative.
        """
        geoms = np.zeros(stage.model.ngeom, _PIECE)
        geoms["camera_from_geom"][..., :3] = stage.data.geom_xmat.reshape(-1, 3, 3)
        geoms["camera_from_geom"][..., 3] = stage.data.geom_xpos - camera_m
        geoms["colour"] = self._materials.albedo
        geoms["surface"] = self._materials.surface
        for geom, rgb in stage.paint_rgb.items():
            geoms["colour"][geom] = rgb
        for geom in stage.faces:
            geoms["colour"][geom] = 1.0
        self._geoms = geoms

    def set_lights(self, lights: Lights, maps: ShadowMaps | None, camera_m: Array) -> None:
        """Uploads the lights of a frame.

        Args:
            lights: distant lights and point lights.
            maps: shadow maps of the first light; None if it casts no shadows.
            camera_m: (3,) world position of the camera.
        """
        frame = np.zeros(1, _FRAME)
        if maps is not None:
            frame["sun_axes"][0, :, :3] = maps.axes
            frame["shadow_scale"][0, :, :3] = maps.scale
            frame["shadow_scale"][0, :, 3] = maps.texel_m
            frame["shadow_offset"][0, :, :3] = maps.offset
            frame["shadow_end"][0, :3] = (*maps.end_m, maps.town_ends)
        frame["irradiance"][0, :, :3] = self._environment.irradiance
        count = len(lights.light)
        frame["towards_light"][0, :count] = lights.towards
        frame["towards_light"][0, :count, :3] -= lights.towards[:, 3:] * camera_m
        frame["light"][0, :count, :3] = lights.light
        frame["environment"][0, 0] = max(len(self._environment.levels) - 1, 0)
        self._frame.upload(frame)
        GL.glBindBufferBase(GL.GL_UNIFORM_BUFFER, 0, self._frame.handle)
        GL.glBindTextureUnit(_ENVIRONMENT_UNIT, self._environment_map)
        GL.glBindTextureUnit(_SPLIT_SUM_UNIT, self._split_sum)
        self._light_flags = (f"LIGHTS {count}", *(("SHADOWS",) if maps is not None else ()))

    def spheres(self, stage: Stage) -> tuple[Array, Array]:
        """The bounding spheres of the P pieces of triangles: (P, 3) centres in world coordinates and (P,) radii,
        metres.

        Args:
            stage: the posed world.
        """
        centres_m, radii_m = self._spheres
        turns = stage.data.geom_xmat.reshape(-1, 3, 3)[self.geom_of_piece]
        return np.einsum("pij,pj->pi", turns, centres_m) + stage.data.geom_xpos[self.geom_of_piece], radii_m

    def present(self, stage: Stage) -> Mask:
        """The pieces of triangles that a stage contains: (P,) bool, True if the geom of the piece is drawn.

        Args:
            stage: the posed world; geoms of actors that a sample does not use are not drawn.
        """
        if stage.is_absent is None:
            return np.ones(len(self.geom_of_piece), np.bool_)
        return np.asarray(~stage.is_absent[self.geom_of_piece])

    def sample_vertices(self, stage: Stage, chosen: Mask) -> Array:
        """The (N, 3) world positions of a few vertices of each chosen piece of triangles. If no piece is chosen,
        the only position is the origin.

        Args:
            stage: the posed world.
            chosen: (P,) bool, the chosen pieces.
        """
        marks_m = self._samples_m[chosen]
        geoms = self.geom_of_piece[chosen]
        turns = stage.data.geom_xmat.reshape(-1, 3, 3)[geoms]
        places = np.einsum("pij,pkj->pki", turns, marks_m) + stage.data.geom_xpos[geoms][:, None]
        return np.concatenate([places.reshape(-1, 3), np.zeros((int(len(geoms) == 0), 3))])

    def draw_depth(self, selection: Selection) -> None:
        """Draws pieces of triangles with the current shader program, without materials, in the given order.

        Args:
            selection: indices of the pieces.
        """
        self._submit([(selection, None)])

    def draw_shaded(self, selection: Selection, matrix: Array, flags: tuple[str, ...]) -> None:
        """Draws pieces of triangles with their materials.

        Args:
            selection: indices of the pieces; pieces of the same material keep their order.
            matrix: (4, 4) matrix from positions relative to the camera to clip space.
            flags: preprocessor definitions for all shaders.
        """
        geoms = self.geom_of_piece[selection]
        # Each geom that shows a patch is a group of its own.
        kinds = np.where(np.isin(geoms, list(self._face_of_geom)), -1 - geoms, self._batch_of_geom[geoms])
        groups = [selection[kinds == kind] for kind in dict.fromkeys(kinds.tolist())]
        self._submit([(group, (matrix, flags)) for group in groups])

    def _submit(self, groups: list[tuple[Selection, tuple[Array, tuple[str, ...]] | None]]) -> None:
        """Issues draw calls for each group, of at most `gl.PIECES` pieces each."""
        batches = [
            (group[first : first + gl.PIECES], look if first == 0 else None)  # further batches show the same material
            for group, look in groups
            for first in range(0, len(group), gl.PIECES)
        ]
        if not batches:
            return
        lengths = [-(-len(batch) // _ALIGNED) * _ALIGNED for batch, _ in batches]
        begins = (np.cumsum(lengths) - lengths).tolist()
        # Each range has the full length of the uniform block.
        records = np.zeros(begins[-1] + gl.PIECES, _PIECE)
        for (batch, _), begin in zip(batches, begins, strict=True):
            part = records[begin : begin + len(batch)]
            part[:] = self._geoms[self.geom_of_piece[batch]]
            part["number"] = batch
        self._pieces.upload(records)
        for (batch, look), begin in zip(batches, begins, strict=True):
            if look is not None:
                self._bind_material(int(self.geom_of_piece[batch[0]]), *look)
            size = gl.PIECES * _PIECE.itemsize
            GL.glBindBufferRange(
                GL.GL_UNIFORM_BUFFER, _PIECES_BINDING, self._pieces.handle, begin * _PIECE.itemsize, size
            )
            gl.draw_elements(*(self._commands[name][batch] for name in ("count", "first", "base")))

    def _bind_material(self, geom: int, matrix: Array, flags: tuple[str, ...]) -> None:
        """Makes the program and the textures of a geom's material current."""
        pictures = [self._textures.of(texture) for texture in self._materials.textures[geom].tolist()]
        pictures[0] = self._face_of_geom.get(geom, pictures[0])
        for unit, picture in enumerate(pictures):
            if picture:
                GL.glBindTextureUnit(unit, picture)
        key = (
            *(flag for flag, picture in zip(TEXTURE_ROLES, pictures, strict=True) if picture),
            *self._light_flags,
            *flags,
        )
        if key not in self._surfaces:
            self._surfaces[key] = gl.Program("surface.vert", "surface.frag", key)
        self._surfaces[key].use(clip_from_relative=matrix)


def _sample_vertices(geometry: Geometry) -> Array:
    """(P, `_VERTEX_SAMPLES`, 3) a few vertices of each piece, in the frame of its geom."""
    command = geometry.commands
    shares = np.linspace(0, 1, _VERTEX_SAMPLES)
    chosen = command["first"][:, None] + ((command["count"][:, None] - 1) * shares).astype(np.int64)
    vertices = command["base"][:, None].astype(np.int64) + geometry.indices[chosen]
    return np.asarray(geometry.vertices["position_m"][vertices].astype(np.float64))


def _vertex_array(geometry: Geometry) -> int:
    """A vertex array with the vertices and indices of all pieces."""
    array = np.zeros(1, np.uint32)
    GL.glCreateVertexArrays(1, array)
    handle = int(array[0])
    GL.glVertexArrayVertexBuffer(handle, _VERTICES, gl.static_buffer(geometry.vertices), 0, VERTEX.itemsize)
    GL.glVertexArrayElementBuffer(handle, gl.static_buffer(geometry.indices))
    for place, (name, count, kind) in enumerate(
        (("position_m", 3, GL.GL_FLOAT), ("normal", 3, GL.GL_SHORT), ("texcoord", 2, GL.GL_FLOAT))
    ):
        _, offset = VERTEX.fields[name][:2]  # type: ignore[index]
        GL.glEnableVertexArrayAttrib(handle, place)
        GL.glVertexArrayAttribFormat(handle, place, count, kind, kind == GL.GL_SHORT, offset)
        GL.glVertexArrayAttribBinding(handle, place, _VERTICES)
    return handle
