"""Facts about the package of a plugin for a record: hash of its code, hash of its wheel, licence, authors, paper."""

from __future__ import annotations

import hashlib
import importlib.metadata
import importlib.util
import json
from functools import cache
from pathlib import Path

from gear.leaderboard.field_checks import LONGEST_TEXT, SHA256

SKIPPED = "__pycache__"


@cache
def code_sha256(module: str) -> str:
    """The SHA-256 over names and content of all files of a top-level package or module.

    It does not depend on whether the package was installed from a wheel or from a checkout. For `gear` itself only the
    Python files count. A module without files, such as one that was made at run time, has the hash of its name.

    Args:
        module: dotted name of any module of the package.
    """
    top = module.partition(".")[0]
    digest = hashlib.sha256(top.encode())
    try:
        spec = importlib.util.find_spec(top)
    except (ImportError, ValueError):
        spec = None
    for path, name in _files(spec.submodule_search_locations, spec.origin) if spec is not None else ():
        if top != "gear" or path.suffix == ".py":
            digest.update(f"{name}\0{hashlib.sha256(path.read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()


def _files(folders: list[str] | None, origin: str | None) -> list[tuple[Path, str]]:
    """The files of a package with their names relative to its folder, or the single file of a module."""
    if folders:
        root = Path(folders[0])
        found = sorted(path for path in root.rglob("*") if path.is_file() and SKIPPED not in path.parts)
        return [(path, path.relative_to(root).as_posix()) for path in found]
    return [(Path(origin), Path(origin).name)] if origin is not None and Path(origin).is_file() else []


def wheel_sha256(package: str) -> str | None:
    """The SHA-256 of the wheel from which pip installed a package (PEP 610); None if pip did not note it."""
    try:
        noted = importlib.metadata.distribution(package).read_text("direct_url.json")
        found = json.loads(noted or "{}")["archive_info"]["hashes"]["sha256"]
    except (importlib.metadata.PackageNotFoundError, KeyError, TypeError, ValueError):
        return None
    return found if isinstance(found, str) and SHA256.fullmatch(found) else None


def package_metadata(package: str) -> dict[str, str]:
    """Licence, authors and paper (the project URL named `Paper`) of a package; empty texts where it states none."""
    try:
        metadata = importlib.metadata.metadata(package)
    except importlib.metadata.PackageNotFoundError:
        return {"licence": "", "authors": "", "paper": ""}
    urls = [text.partition(",") for text in metadata.get_all("Project-URL") or []]
    paper = next((url.strip() for name, _, url in urls if name.strip().casefold() == "paper"), "")
    licence, authors = (
        next((text for name in names for text in metadata.get_all(name) or []), "")
        for names in (("License-Expression", "License"), ("Author", "Author-email"))
    )
    return {"licence": printable(licence), "authors": printable(authors), "paper": printable(paper)}


def printable(text: str) -> str:
    """The text in one line, without characters that cannot be printed, and cut to the length that records allow."""
    line = " ".join(str(text).split())
    return "".join(mark for mark in line if mark.isprintable())[:LONGEST_TEXT]
