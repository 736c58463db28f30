"""Built-in model plugins, one file each. `gear models` lists them."""
