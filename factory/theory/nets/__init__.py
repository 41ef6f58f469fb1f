"""Nets: Definitions 3.1 to 3.6 as values, and what is proved of them.

* Values: `petri.py`, `threaded.py`, `gears.py`, `train.py`, and `marked.py` for tokens alone.
* Proofs: `verify.py` (`verify`) of the compiled net, with `composition.py`; live where `token_free`
  of `marked.py` leaves no transition stuck. `coordinated.py` (`CoordinatedNet.deadlock`) is the
  same question of a net with a layout's waits, and `exclusion.py` proves which of its places are
  never marked together.
* Times: `cycle_ratio.py`, `ways.py`.
"""
