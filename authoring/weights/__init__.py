"""What the reference weights are trained on and measured with. Run `python -m authoring.weights --help`."""
