"""Compositors put patches into stored pictures, differentiably with respect to the patches.

Attacks use compositors. The collection of datasets never imports this package.
"""
