"""Renderers: linear colour, metric depth and geom ids of one camera at once. The only room that knows a GPU exists."""

from gear.render.probing import ProbeResult, probe
from gear.render.registry import RENDERERS, describe, open_renderer

__all__ = ["RENDERERS", "ProbeResult", "describe", "open_renderer", "probe"]
