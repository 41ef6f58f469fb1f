"""Robot types as their files describe them: `catalogue.py` reads a catalogue, `reader.py` the MJCF
of a type, and refuses by name what would be another robot than the one that is laid out."""
