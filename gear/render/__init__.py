"""Renderers: linear colour, metric depth and geom ids of one camera at once. The only room that knows a GPU exists."""

from gear.render.opening import RENDERERS, describe, open_renderer
from gear.render.probing import ProbeResult, probe

__all__ = ["RENDERERS", "ProbeResult", "describe", "open_renderer", "probe"]
