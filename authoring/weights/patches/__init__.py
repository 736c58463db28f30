"""The pre-computed patches: made scene by scene, measured in the world, installed into the weights package."""
