"""MJCF assets: finding them by name, their facts, their geoms' classes and triangles."""
