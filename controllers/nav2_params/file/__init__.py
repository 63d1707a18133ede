"""A parameter file before its sections are read: its text and lines, its nodes, its release and its behaviour tree."""
