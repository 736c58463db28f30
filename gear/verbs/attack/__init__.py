"""The verb `attack`: optimises adversarial patches for any task and any model."""
