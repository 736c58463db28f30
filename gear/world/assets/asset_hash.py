"""Finds all files that can affect the pictures of a town, and computes one hash of them."""

from __future__ import annotations

import hashlib
import os
import re
import time
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

from gear.values.errors import TownError
from gear.values.regular_file import check_regular
from gear.values.resources import data_dir
from gear.world.assets.library import AssetLibrary, read_xml

ASSET_SUFFIXES = (".xml", ".obj", ".msh", ".stl", ".png")
"""Suffixes of the files in a town's folders that count as assets."""

_KEY_POINT_LINE = re.compile(rb"""\s*<numeric\s+name=["']key_point\.[^<>]*/>""")
"""An element that names a key point, with the white space before it."""

_SETTLED_NS = 2_000_000_000
"""Age of a file's last change from which its hashes are remembered, nanoseconds; file systems count in steps of up to
two seconds.
"""

_HASHES: dict[Path, tuple[tuple[int, ...], tuple[str, str]]] = {}


def asset_files(library: AssetLibrary) -> dict[str, Path]:
    """All MJCF files, meshes and textures of a town and of the actors and boards that it uses, for a hash of them.

    Args:
        library: the asset library of the town.

    Returns:
        The paths by a name that does not depend on where the folders are, so the hash is the same on every machine.
    """
    own = data_dir("mjcf")
    roots = [library.town, library.town.with_suffix("")]
    roots += [library.folder("vehicle"), library.folder("pedestrian"), library.folder("surface")]
    if any(root.is_relative_to(own) for root in roots):
        roots.append(own / "textures")
    files: dict[str, Path] = {}
    others = []  # gear's own files refer to no other files, and there are many of them
    for root in roots:
        found = dict(_assets_in(root, library.town))
        files.update(found)
        if not root.is_relative_to(own):
            others += [path for path in found.values() if path.suffix.lower() == ".xml" or path == library.town]
    known = {path.resolve() for path in files.values()} if others else set()
    for path in others:
        for name, referred in _referred(path):
            if referred.resolve() not in known:
                files.setdefault(f"referred/{path.name}/{name}", referred)
    return files


def _assets_in(root: Path, town: Path) -> Iterator[tuple[str, Path]]:
    """The assets in a folder, or the file `root` itself: each one's name and path.

    `os.walk` takes less time than `Path.rglob`.
    """
    if not root.is_dir():
        if root.is_file() and (root.suffix.lower() in ASSET_SUFFIXES or root == town):
            yield f"{root.name}/.", root
        return
    for name, _, files in os.walk(root):
        folder = Path(name)
        inner = folder.relative_to(root).as_posix()
        prefix = f"{root.name}/" if inner == "." else f"{root.name}/{inner}/"
        for path in map(folder.joinpath, files):
            if (path.suffix.lower() in ASSET_SUFFIXES or path == town) and path.is_file():
                yield f"{prefix}{path.name}", path


def _referred(path: Path) -> Iterator[tuple[str, Path]]:
    """The existing files to which an MJCF file and its includes refer: each name as written, and its path."""
    elements: list[tuple[Path, ET.Element]] = []
    files, folders = [path], dict[str, str]()
    for file in files:  # `files` grows by the files that are included
        try:
            root = read_xml(file)
        except TownError:
            continue  # the error is reported when the file is read for the world
        for compiler in root.iter("compiler"):
            folders.update({key: value for key, value in compiler.items() if key.endswith("dir")})
        elements += [(file, element) for element in root.iter()]
        names = [name for include in root.iter("include") if (name := include.get("file"))]
        included = [Path(os.path.normpath(base / name)) for base in _bases(path, file) for name in names]
        files += [one for one in included if one not in files]
    usual = folders.get("assetdir", "")
    for file, element in elements:
        folder = folders.get("texturedir" if element.tag == "texture" else "meshdir", usual)
        for key, name in element.items():
            for base in _bases(path, file) if key.startswith("file") else ():
                target = base / ("" if element.tag == "include" else folder) / name
                if target.exists() and not target.is_dir():
                    _check_asset(path, target)
                    yield name if base == path.parent else f"{file.name}/{name}", target


def _check_asset(path: Path, target: Path) -> None:
    """Checks that a referenced file is a regular file.

    Raises:
        TownError: it is a device, a FIFO or a socket, for which MuJoCo would wait forever.
    """
    try:
        check_regular(target)
    except OSError as error:
        raise TownError(path, f"refers to {target}, which {error.strerror}") from error


def _bases(path: Path, file: Path) -> list[Path]:
    """The folders to which paths in `file` may be relative: its own folder, and the folder of the MJCF file that
    includes it.
    """
    return list(dict.fromkeys((path.parent, file.parent)))


def assets_digest(library: AssetLibrary) -> str:
    """The SHA-256 hash (hex) of everything that pictures of a town can show.

    It covers the names and contents of all MJCF files, meshes and textures, without the key points of actors, which no
    picture shows (`key_points_digest`). So trained weights still fit a town whose people get key points.

    Args:
        library: the asset library of the town.
    """
    return _digest_of({name: _hashes_of(path)[0] for name, path in asset_files(library).items()})


def without_key_points(mjcf: bytes) -> bytes:
    """Returns the content of an MJCF file without the elements that name key points."""
    return _KEY_POINT_LINE.sub(b"", mjcf)


def key_points_digest(library: AssetLibrary) -> str:
    """The SHA-256 hash (hex) of the key points of all actors that a town uses; "" if none has any.

    Args:
        library: the asset library of the town.
    """
    hashes = {name: _hashes_of(path)[1] for name, path in asset_files(library).items()}
    with_points = {name: digest for name, digest in hashes.items() if digest}
    return _digest_of(with_points) if with_points else ""


def _hashes_of(path: Path) -> tuple[str, str]:
    """The SHA-256 hashes (hex) of a file: of the part that pictures can show, and of its key points ("" for none).

    They are computed once for a state of the file: every change sets the time `st_ctime_ns`. A file that has just been
    changed is not remembered, because a second change in the same tick of the clock would leave the time as it is.
    """
    status = path.stat()
    state = (status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns)
    known = _HASHES.get(path)
    if known is not None and known[0] == state:
        return known[1]
    content, key_points = path.read_bytes(), b""
    if path.suffix.lower() == ".xml":
        key_points = b"".join(_KEY_POINT_LINE.findall(content))
        content = without_key_points(content)
    hashes = hashlib.sha256(content).hexdigest(), hashlib.sha256(key_points).hexdigest() if key_points else ""
    if time.time_ns() - status.st_ctime_ns > _SETTLED_NS:
        _HASHES[path] = state, hashes
    return hashes


def _digest_of(hashes: dict[str, str]) -> str:
    """The SHA-256 hash (hex) of the names of files and of the hashes of their contents."""
    digest = hashlib.sha256()
    for name in sorted(hashes):
        digest.update(f"{name}\0{hashes[name]}\n".encode())
    return digest.hexdigest()
