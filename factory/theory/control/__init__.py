"""Control: navigation functions, the modes that are made of them, and the governor, which follows
their field within the limits of the robots.

`laws.py` has a function for each law that a template can name; what it makes is a `Mode`
(`mode.py`). `navigation.py` (`Bundle.field`) is the field of all active modes at once, with the
gates and obstacles of `obstacles.py`. `governor.py` lets the references of a run follow it;
`governed.py` and `profile.py` say beforehand when they arrive.
"""
