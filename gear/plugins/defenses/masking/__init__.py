"""What defenses share that locate patches in a picture and replace the located pixels: Jedi, NutNet, SAC."""
