"""The factory as the compiler makes it: robots, operations, programs, and the order in which units
are made.

`factory.py` (`Factory`) consists of robots (`robot.py`, with the axes of `axes.py`) and operations
(`operation.py`). `programs.py` reads each robot's program off its gear, `approaches.py` says from
where inputs can come together, `gripping.py` which grips take time.
"""
