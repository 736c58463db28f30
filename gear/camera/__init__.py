"""The camera: turns linear frames into pictures, by weather, effects and a response that no picture influences."""

from gear.camera.response import IDENTITY, Response, face_light, response_for

__all__ = ["IDENTITY", "Response", "face_light", "response_for"]
