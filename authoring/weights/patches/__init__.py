"""The pre-computed patches: made for each scene, measured in renders, and installed into the weights package."""
