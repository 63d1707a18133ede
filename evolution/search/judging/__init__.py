"""What a set of maps is worth."""
