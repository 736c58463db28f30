"""Progress of the verbs: bars in terminals and notebooks, plain lines elsewhere."""
