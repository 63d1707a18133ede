"""How sets of maps are searched."""
