"""The frame of a report as one self-contained HTML page: style sheet, policy, heading."""

from __future__ import annotations

import html
from collections.abc import Iterable

STYLE = """
body { font: 15px/1.5 system-ui, "Segoe UI", Roboto, "Noto Sans", sans-serif; color: #1b2027; background: #fff;
  max-width: 76rem; margin: 2rem auto; padding: 0 1.25rem; }
h1 { font-size: 1.5rem; margin: 0 0 .25rem; } h2 { font-size: 1.15rem; margin: 2.5rem 0 .5rem; }
h3 { font-size: .95rem; margin: 1.5rem 0 .5rem; } p { margin: .25rem 0; } .dim { color: #5b6672; }
.wide { overflow-x: auto; } table { border-collapse: collapse; font-size: .85rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .25rem .7rem; white-space: nowrap; } th { border-bottom: 2px solid #1b2027; }
tr.first td { border-top: 1px solid #c5ccd4; } img { max-width: 100%; height: auto; }
.row { display: flex; flex-wrap: wrap; gap: .75rem; align-items: flex-start; } figure { margin: 0; }
figcaption { font-size: .8rem; color: #5b6672; } .row img { border: 1px solid #c5ccd4; display: block; }
td.grey { background: #e4e4e4; } td.reference { font-weight: 700; } td.worse { color: #b00000; }
td.better { color: #007000; } td.same { color: #0000b0; } pre { white-space: pre-wrap; font-size: .8rem; }
@media print {
  @page { size: A4 landscape; margin: 10mm; } body { max-width: none; margin: 0; padding: 0; font-size: 10px; }
  .wide { overflow: visible; } table { width: 100%; font-size: 7px; } td.grey { print-color-adjust: exact; }
  th, td { white-space: normal; padding: .15rem .25rem; overflow-wrap: anywhere; } h2, h3 { break-after: avoid; }
  tr, figure, img { break-inside: avoid; } .row img { max-width: 64mm; }
}
"""

POLICY = "default-src 'none'; img-src {sources}; style-src 'unsafe-inline'"
"""Content policy of the page: no scripts, no connections; `{sources}` is where pictures may come from."""

EMBEDDED, NEARBY = "data:", "'self' file:"
"""Sources of pictures: inside the page, or in files next to it."""


def report_page(title: str, parts: Iterable[str], *, sources: str = EMBEDDED) -> str:
    """The whole page as HTML text.

    Args:
        title: title and heading; it is escaped.
        parts: HTML of the body, one element each.
        sources: sources of pictures that the content policy allows.
    """
    safe = html.escape(title, quote=True)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{safe}</title>\n'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY.format(sources=sources)}">\n'
        f'<meta name="viewport" content="width=device-width"><style>{STYLE}</style></head>\n'
        f"<body><h1>{safe}</h1>\n" + "\n".join(parts) + "\n</body></html>\n"
    )
