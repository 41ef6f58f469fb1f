"""Colours of LDraw by their codes."""

from __future__ import annotations

from factory.importing.ldraw.lines import Colours, rgba_of

INHERITED = (16, 24)
"""The colour of the line that refers to this file."""

_DIRECT = 0x2000000

_COMMON = """
0 1B2A34  1 1E5AA8  2 00852B  3 069D9F  4 B40000  5 D3359D  6 543324  7 8A928D  8 545955
9 97CBD9  10 58AB41  11 00AAA4  12 F06D61  13 F6A9BB  14 FAC80A  15 F4F4F4  17 ADD9A8
18 FFD67F  19 D7BA8C  20 AFBED6  22 671F81  23 0E3E9A  25 D67923  26 901F76  27 A5CA18
28 897D62  29 FF9ECD  30 A06EB9  31 CDA4DE  70 5F3109  71 969696  72 646464  73 7396C8
85 441A91  191 FCAC00  212 9DC3F7  226 FFEC6C  272 19325A  288 00451A  308 352100
320 720012  378 708E7C  379 70819A  484 91501C
"""
_CLEAR = """
33 0020A0  34 237841  35 56E646  36 C91A09  40 635F52  41 559AB7  42 C0FF00  43 AEE9EF
46 F5CD2F  47 FCFCFC  57 F08F1C
"""
"""Codes and values of LDraw's LDConfig.ldr; a library with its own replaces them."""


def common_colours() -> Colours:
    """The colours that models use without a library."""
    found: Colours = {}
    for words, alpha in ((_COMMON.split(), 255), (_CLEAR.split(), 128)):
        for code, value in zip(words[::2], words[1::2], strict=True):
            found[int(code)] = rgba_of(int(value, 16), alpha)
    return found


def direct_colour(code: int) -> tuple[float, float, float, float] | None:
    """The colour of a code 0x2RRGGBB, or 0x3RRGGBB, which is half clear."""
    if code >> 24 not in (2, 3):
        return None
    return rgba_of(code & 0xFFFFFF, 255 if code < _DIRECT + 0x1000000 else 128)
