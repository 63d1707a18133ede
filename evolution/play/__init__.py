"""The playground: draw a map, change a parameter, and see what the controllers do.

In: maps, parameters and controllers of the command line, and messages of a page in the browser. Out: the runs, their
results and what the robots believe, computed by the same code as ``mapbench bench`` and ``mapbench drive``.
"""
