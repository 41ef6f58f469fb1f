"""Import of products: LDraw models, trees of meshes, bills of materials, scene files, loose meshes.

Each reader makes drafts of a file; `assembling` makes the PAG of them. No file is written here: an
`Imported` holds the contents of all files by their path in the output folder.
"""

from factory.apps.importing.importer import Imported, Options, import_product

__all__ = ["Imported", "Options", "import_product"]
