"""A town becomes files: its meshes in a folder of its name, its MJCF beside it."""

from __future__ import annotations

import shutil
from pathlib import Path

from authoring.kit.parts import Sink
from authoring.mesh import write_obj
from authoring.towns.chunks import chunked
from authoring.towns.document import Document, Geom
from authoring.towns.props import Props

__all__ = ["write_document", "write_meshes"]


def write_meshes(
    folder: Path, name: str, bounds: tuple[float, float, float, float], sink: Sink, props: Props, *, cell_m: float
) -> Document:
    """Writes what a town was built of, in place of what was there; gives its document, which knows all geoms and bodies
    and no solids, lanes or other places yet.

    Args:
        folder: of all towns.
        name: of this one.
        bounds: as the document's.
        sink: what is seen and stands nowhere else.
        props: what stands in many places.
        cell_m: side of the squares in which the sink's parts are cut.
    """
    document = Document(name, bounds)
    meshes = folder / name
    shutil.rmtree(meshes, ignore_errors=True)
    meshes.mkdir(parents=True)
    for chunk in chunked(sink.parts(), cell_m=cell_m):
        write_obj(meshes / f"{chunk.name}.obj", chunk.mesh, is_patchwork=True)
        document.meshes.append(chunk.name)
        document.geoms.append(Geom(mesh=chunk.name, material=chunk.material, label=chunk.label))
    for mesh_name, mesh in props.meshes.items():
        write_obj(meshes / f"{mesh_name}.obj", mesh, is_patchwork=True)
        document.meshes.append(mesh_name)
    document.geoms.extend(props.geoms)
    document.bodies.extend(props.bodies)
    return document


def write_document(folder: Path, document: Document) -> None:
    """Writes the MJCF."""
    (folder / f"{document.name}.xml").write_text(document.text(), encoding="utf-8", newline="\n")
