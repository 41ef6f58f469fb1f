"""From a PAG and a plan to a factory.

`compiler.py` (`compile_pag`) is the paper's Compile. `expanding.py` makes operations of statements,
`assigning.py` gives tours to robots and composes the net; the other modules are the variants that a
plan can ask for, and the conditions of section 5.
"""
