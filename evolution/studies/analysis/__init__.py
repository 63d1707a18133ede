"""Analysis of a study: its results are read back, compared, tested, and put into tables and figures.

Comparisons come first (``judges``, ``comparisons``, ``held_out``); tables, figures and the verdict only present them.
"""
