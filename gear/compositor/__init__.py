"""Compositors put patches into stored pictures, differentiably. Collecting never imports this package."""
