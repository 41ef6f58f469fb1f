"""Parts alone, without a factory, as a model of the engine: for pictures of a product."""

from __future__ import annotations
