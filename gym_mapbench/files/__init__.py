"""Files: bounded reading of untrusted ones, and writing in one step.

In: a path. Out: bytes, text, arrays, or the document of a YAML or JSON file; or one line of error. Size, depth and kind
of a file are checked first, so no file can fill the memory or run code.
"""
