"""The text of the HTML page: template, style, script, index and pictures.

The contents of the dataset are embedded as data, never as HTML. The index is JSON in a script block that browsers do
not execute; every `<` in it is escaped, and the script inserts it as text. A content security policy allows only the
page's own script, identified by its hash, and only pictures to be loaded.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
from collections.abc import Iterable, Iterator, Sequence
from importlib.resources import files

from gear.values.serial import Json
from gear.view.build import Entry
from gear.view.channels import KINDS, Channel
from gear.view.counts import without_identifiers
from gear.view.encoding import MEDIA_TYPE

SCRIPTS = (
    "dom", "store", "histogram", "sorting", "filters", "legend", "picture", "grid", "map", "tables", "compare",
    "sample", "statistics", "app",
)  # fmt: skip
"""Names of the JavaScript files in `gear/view/page`, in the order in which they are joined."""


def asset(name: str) -> str:
    """Returns the text of the file `name` in `gear/view/page`."""
    return (files("gear.view") / "page" / name).read_text(encoding="utf-8")


def script(names: Sequence[str] = SCRIPTS) -> str:
    """Returns the JavaScript of a page as one function without global variables.

    Args:
        names: names of the JavaScript files in `gear/view/page`, in the order in which they are joined.
    """
    body = "\n".join(asset(f"{name}.js") for name in names)
    return f'(() => {{\n"use strict";\n{body}\n}})();\n'


def index_of(entries: Sequence[Entry], about: dict[str, Json]) -> dict[str, Json]:
    """Returns the JSON index of the page, which its script reads first: `about` (metadata of the split), the channels,
    and one entry per sample.

    Args:
        entries: the samples of the page.
        about: metadata of the split.

    Returns:
        The keys are `about`, `mediaType` (of the pictures), `channels` (kinds of pictures) and `samples`.
    """
    channels = channels_of(entries)
    rows = []
    for entry, counts in zip(entries, without_identifiers([e.row["counts"] for e in entries]), strict=True):
        rows.append(entry.row | {"counts": counts, "problem": entry.problem, "pictures": _pictures(entry, channels)})
    return {
        "about": about,
        "mediaType": MEDIA_TYPE,
        "channels": [
            {"kind": one.kind, "name": one.name, "dataset": one.dataset, "evaluation": one.evaluation}
            for one in channels
        ],
        "samples": rows,
    }


def channels_of(entries: Sequence[Entry]) -> list[Channel]:
    """Returns all channels of the entries in the order of `KINDS`, and otherwise in the order of the samples."""
    found = dict.fromkeys(channel for entry in entries for channel in entry.pictures)
    return sorted(found, key=lambda channel: KINDS.index(channel.kind))


def _pictures(entry: Entry, channels: Sequence[Channel]) -> list[Json]:
    return [
        {
            "width": picture.width_px,
            "height": picture.height_px,
            "whole": picture.is_whole,
            "camera": entry.cameras[channel],
            "original": entry.originals.get(channel),
        }
        if (picture := entry.pictures.get(channel))
        else None
        for channel in channels
    ]


def document(title: str, entries: Sequence[Entry], about: dict[str, Json]) -> Iterator[str]:
    """Yields the HTML page in pieces of text; the index comes before the pictures, so a browser can start before all
    pictures are loaded.

    Args:
        title: title of the page.
        entries: the samples of the page.
        about: metadata of the split.
    """
    blocks = _blocks(entries)
    return framed(
        "page.html", title=title, style=asset("style.css"), code=script(), index=index_of(entries, about), blocks=blocks
    )


def _blocks(entries: Sequence[Entry]) -> Iterator[str]:
    """Yields the script blocks with metadata and pictures of the samples."""
    channels = channels_of(entries)
    for number, entry in enumerate(entries):
        yield block(f"d{number}", entry.detail)
        for place, channel in enumerate(channels):
            if channel in entry.pictures:
                yield block(f"p{number}.{place}", entry.pictures[channel].data)


def framed(template: str, *, title: str, style: str, code: str, index: Json, blocks: Iterable[str]) -> Iterator[str]:
    """Yields an HTML page in pieces of text, with its content security policy.

    Args:
        template: name of the HTML file in `gear/view/page`; data blocks replace its placeholder `{{blocks}}`.
        title: title of the page; it is escaped.
        style: text of the style sheet.
        code: text of the script.
        index: what the script reads first, as JSON.
        blocks: script blocks with data, as `block` makes them.
    """
    fillings = {
        "policy": html.escape(policy(style, code)),
        "title": html.escape(title),
        "style": style,
        "index": embedded(index),
        "script": code,
    }
    head, tail = asset(template).split("{{blocks}}")
    yield filled(head, fillings)
    yield from blocks
    yield tail


def policy(style: str, code: str) -> str:
    """Returns the content security policy of the page, which allows only its own style and script, by their hashes.

    Args:
        style: text of the style sheet.
        code: text of the script.
    """

    def digest(text: str) -> str:
        return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"

    return (
        f"default-src 'none'; script-src {digest(code)}; style-src {digest(style)};"
        " img-src data: 'self' file:; base-uri 'none'; form-action 'none'"
    )


def embedded(value: Json) -> str:
    """Returns `value` as JSON text with `<`, `>` and `&` escaped, so it cannot end the HTML script block around it."""
    text = json.dumps(value, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def filled(template: str, fillings: dict[str, str]) -> str:
    """Returns a template with its placeholders `{{name}}` replaced in one pass, so that placeholders inside inserted
    texts are not replaced.

    Args:
        template: text with placeholders.
        fillings: text for each placeholder, by name.
    """
    return re.sub(r"\{\{(\w+)\}\}", lambda match: fillings[match[1]], template)


def block(name: str, data: bytes) -> str:
    """Returns data as a script block with the id `name`, which browsers do not execute; the content is base64."""
    return f'<script type="text/plain" id="{name}">{base64.b64encode(data).decode()}</script>\n'
