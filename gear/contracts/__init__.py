"""Contracts: the protocols and specs of plugins, and the protocols between gear's packages. This package imports
only `gear.values`.
"""
