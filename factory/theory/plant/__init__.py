"""The factory as the compiler makes it: robots, operations, programs, and the order in which units
are made."""
