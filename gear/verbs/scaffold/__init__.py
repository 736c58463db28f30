"""`gear new`: writes a complete small package for a new task, model, attack, defense, controller, metric or logger."""
