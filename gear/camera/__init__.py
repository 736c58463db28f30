"""The camera: turns a renderer's linear frames into 8-bit pictures.

The steps are weather, lamps, optional effects of lens and sensor, and the tone curve. No step adapts to the content of
the picture, so a patch changes only the pixels that show the patch.
"""

from gear.camera.response import IDENTITY, Response, face_light, response_for

__all__ = ["IDENTITY", "Response", "face_light", "response_for"]
