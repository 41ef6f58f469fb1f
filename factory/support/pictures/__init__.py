"""Pictures and films as any program has them: `ink.py` draws boxes and words on pixels, `sight.py`
finds a view, `smoothing.py` smooths edges, `still.py` and `video.py` write files."""
