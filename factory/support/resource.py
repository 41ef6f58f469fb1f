"""Resources that must be closed: a film, a log, a painter."""

from __future__ import annotations

from typing import Self

__all__ = ["Closing"]


class Closing:
    """A context manager that closes itself, also after an exception."""

    def close(self) -> None:
        """Finish, and release what is held."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()
