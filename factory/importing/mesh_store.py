"""The mesh files of an imported product: equal ones once, under names that stay in their folder."""

from __future__ import annotations

from hashlib import sha256

from factory.importing.labels import file_stem


class MeshStore:
    """Contents by file name, relative to the output folder."""

    def __init__(self, folder: str) -> None:
        self.folder = folder
        self.files: dict[str, bytes] = {}
        self._names: dict[tuple[str, str], str] = {}
        self._taken: set[str] = set()

    def add(self, name: str, suffix: str, content: bytes) -> str:
        """The path of a mesh with this content, called as nearly as can be `name`."""
        stem, digest = file_stem(name), sha256(content).hexdigest()
        key = (digest, suffix)
        if key not in self._names:
            if f"{stem}{suffix}".lower() in self._taken:
                stem = f"{stem}-{digest[:12]}"
            self._taken.add(f"{stem}{suffix}".lower())
            self._names[key] = path = f"{self.folder}/{stem}{suffix}"
            self.files[path] = content
        return self._names[key]
