"""Compositors put patches into stored pictures, differentiably with respect to the patches.

Attacks use them. Collecting never imports this package.
"""
