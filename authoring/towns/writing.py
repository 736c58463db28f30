"""Writes a town: its meshes into a folder with its name, and its MJCF file next to this folder."""

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
    """Writes the meshes of a town, in place of existing ones; returns its document with all visible geoms and bodies.

    The caller adds solids, lanes and other places to the document.

    Args:
        folder: folder of all towns.
        name: name of the town.
        bounds: bounds of the town, as in the document.
        sink: visible parts that occur only once.
        props: objects that occur in many places.
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
