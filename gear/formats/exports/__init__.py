"""The layouts to which `gear export` can write a dataset. Each module defines one layout as `LAYOUT`; the modules
`layout`, `registry` and `sequences` contain shared code.
"""
