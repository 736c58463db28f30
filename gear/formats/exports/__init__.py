"""The layouts of `gear export`. Each module defines one, as `LAYOUT`; `layout` and `registry` are shared code."""
