"""What all folders use, and what knows neither products nor nets.

Modules with an `__all__` are *tools*: general, as plain as a library, so apps use what it lists
beside `factory.api`. They import no module but such ones.

* Errors and output: `errors.py` (`Diagnostic`) with the texts of `explanations/`, `console.py`,
  `progress.py`, `interruption.py`.
* Texts and numbers: `texts.py`, `decimals.py`, `xml_writer.py`; triangle meshes:
  `meshes/`, from `triangles.py` to `mesh_reader.py`; `rotations.py`.
* Files: `files.py`, `guard.py`, `claim.py`, `cache.py`, `resources.py`; their contents:
  `tables.py`, `toml_files.py`, `xml_tree.py`.
* Pictures and films: `pictures/`, from `ink.py` to `video.py`.
* What a user sets: `settings.py` (`Settings`), `user_defaults.py`, `bounds.py`.
* The engine and GL: `engine.py`, `gl.py`.
* What apps and other packages give: `apps.py`, `extensions.py`.
* Values: `keeping.py`, `showing.py`, `arrays.py`.
"""
