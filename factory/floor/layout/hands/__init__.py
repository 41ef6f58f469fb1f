"""Where and how each robot holds what it carries, chosen from the geometry of the parts.

`choosing.py` (`Hands`) goes through the robots, `one_hand.py` (`OneHand.chosen`) chooses among the
places of one robot. The places are those of `surfaces.py` and `places.py`, `groups.py` pairs and
ranks them, and `in_the_way.py` and `apart.py` rule out those where a hand would touch something.
`hand.py` is the value; `tips.py` and `gauges.py` say how much it bears; `limbs.py` and `mounted.py`
say which room it takes; `clamp.py` and `clamping.py` the same of jaws that close. Where nothing
holds, `nearest.py` finds the nearest miss.
"""
