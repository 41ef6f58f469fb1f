"""Products from elsewhere: LDraw models, trees of meshes, bills of materials, made into PAGs.

Each reader makes drafts of a file; `assembling` makes the PAG of them. Nothing is written here:
an `Imported` holds every file that is to be, by its name in the output folder.
"""

from factory.importing.importer import Imported, Options, import_product

__all__ = ["Imported", "Options", "import_product"]
