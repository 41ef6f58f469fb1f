"""Layouts: where each guidepath lies, and the certificate that machines on them never meet.

* The value: `layout.py`, with `guidepath.py`, `way.py`, `visits.py` and `certificate.py`.
* The search, from the outside in: `embedding.py` (`lay_out`), `optimising.py`, `drafting.py`,
  `stretching.py`, `packing.py`, with the shapes that it packs (`shapes.py`, `outline.py`,
  `footprint.py`, `skyline.py`) and the times that it compares (`durations.py`, `bounds.py`).
  `hands/` chooses the grippers meanwhile.
* The proof, which uses nothing of the search: `clearance.py` (`certify`) with `sweeps.py` and
  `crossings.py`; `exclusions.py` decides which of two machines goes first where both need one
  place, with `presence.py`, `nearness.py`, `machines.py`, `staying.py` and `homeward.py`;
  `coordinating.py` makes the coordinated net of it.
"""
