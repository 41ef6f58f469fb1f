"""The record of a run: its states, figures and failures, and the verdict on it.

`state.py` is what a world (`Observation`) and a run (`State`) show after each tick. The end has
`figures.py`, `failures.py`, and `ending.py` where a run was cut off; `verdict.py` (`RunVerdict`)
judges them, after `replay.py` has played the record on the net. `subject.py` is what an observer
knows beforehand that sees the bodies alone, and `findings.py` what it concludes.
"""
