"""Runs in MuJoCo and in the ideal world: the model, the worlds, the supervisor, the record.

`mjcf/model.py` (`build_model`) writes the model, `timing/timed.py` (`Timed`) predicts the run,
`simulation/simulation.py` (`Simulation.run`) makes it, and `record/verdict.py` (`RunVerdict`)
judges it.
"""
