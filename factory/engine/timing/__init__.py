"""The timed net: what a run will take, without running it.

`timed.py` puts a delay on each place of the coordinated net, `timing.py` finds the delays from the
modes, `cycle_time.py` the slowest circuit, `pool.py` how many copies of a part are inside at once.
"""
