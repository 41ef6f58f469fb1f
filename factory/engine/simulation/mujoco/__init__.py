"""The MuJoCo world.

* A tick: `world.py` (`MujocoWorld.step`), `motion.py` (`Motion.step`), which lets axes follow the
  courses of `courses.py`, then `stepping.py` (`take`), which calls `mj_step`, or `fast/`, which
  calls it for many timesteps at once.
* A hand-over: `world.py` (`MujocoWorld.apply`), `parts.py` (`Parts.hand_over`), `holdings.py`
  (`Holdings.move`), then `welds.py` (`Welds.write`), which switches welds and contact masks.
* Supply and removal: `feeders.py`, `sliders.py`, `supply.py`, `passing.py`, `outfeed.py`.
* Axes that go from end to end, each stroke written ahead as a whole (`strokes.py`): sliders, and
  the jaws of grippers (`jaws.py`).
* Checks that change nothing: `inspection.py`, `soundness.py`, `probing.py`, `pressing.py`,
  `product_error.py`.
"""
