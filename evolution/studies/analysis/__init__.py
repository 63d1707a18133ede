"""From the directory of a study to what it shows: results read back, compared, tested, put into tables and figures.

Comparisons come first (``judges``, ``comparisons``, ``fresh``); tables, figures and the verdict only present them.
"""
