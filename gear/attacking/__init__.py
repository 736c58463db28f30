"""What optimises patches: objectives, appearance, regularisers, loops. In torch; attack plugins are made of it."""
