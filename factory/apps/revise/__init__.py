"""The next revision of a product: which robots of its factory stay, and a layout that keeps them.

`matching.py` compares the two trees, `pairing.py` their robots, `pins.py` and `pinning.py` lay out
the new factory, `inheriting.py` reuses entries of the certificate; `family.py` writes two products
as one text, `live.py` changes over during a run.
"""
