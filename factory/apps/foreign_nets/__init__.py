"""Nets that the compiler did not make: read from PNML (`pnml_reader.py`), their gears discovered
(`discover.py`), their properties decided by structure or by exploring markings (`behaviour.py`,
`explore.py`)."""
