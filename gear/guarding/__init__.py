"""What defenses that look into a network have in common: its feature maps, and how unusual they are."""
