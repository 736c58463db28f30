"""The camera: from linear frames to pictures, by one response that no picture can influence."""

from gear.camera.response import IDENTITY, Response, face_light, response_for

__all__ = ["IDENTITY", "Response", "face_light", "response_for"]
