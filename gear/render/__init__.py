"""Renderers: they compute linear colour, metric depth and geom ids for a camera. No other package uses graphics
drivers.
"""

from gear.render.probing import ProbeResult, probe
from gear.render.registry import RENDERERS, describe, open_renderer

__all__ = ["RENDERERS", "ProbeResult", "describe", "open_renderer", "probe"]
