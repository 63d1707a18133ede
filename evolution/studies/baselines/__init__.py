"""What a search is compared with: maps of a cellular automaton, and a fitness that plans instead of driving."""
