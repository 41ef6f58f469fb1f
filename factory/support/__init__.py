"""What all folders use, and what knows neither products nor nets.

* Errors and output: `errors.py` (`Diagnostic`) with the texts of `explanations/`, `console.py`,
  `progress.py`, `interruption.py`.
* Files: `files.py`, `guard.py`, `claim.py`, `cache.py`, `resources.py`; their contents:
  `tables.py`, `xml_tree.py`.
* What a user sets: `settings.py` (`Settings`), `user_defaults.py`, `bounds.py`.
* The engine and GL: `engine.py`, `gl.py`.
* What apps and other packages give: `apps.py`, `extensions.py`.
* Values: `keeping.py`, `showing.py`, `arrays.py`.
"""
