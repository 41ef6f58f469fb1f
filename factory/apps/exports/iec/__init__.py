"""Programs of IEC 61131-3 as values, their text, and the programs of a factory's robots as such.

`declarations.py` has the values, `structured_text.py` their text, `robots.py` the function block of
each robot, and `cell.py` all that a controller of the factory is given.
"""
