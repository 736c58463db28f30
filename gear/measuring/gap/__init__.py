"""Digital patches against rendered ones: pictures, and the effect on a model."""
