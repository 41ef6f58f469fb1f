"""The modes of a laid-out factory.

`modes.py` (`operation_modes`) makes one of each operation; `staging.py` (`stages`) those of robots
that go ahead while they wait for others.
"""
