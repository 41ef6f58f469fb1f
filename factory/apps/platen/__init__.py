"""Platens: movers on tiles in place of carriages on rails."""
