"""Names of parts: whether one says that a part is a screw.

A name is read as people write it, in English and German, French, Italian and Spanish: the last noun
says what a part is (`bolt_hole_plate` is a plate), what follows a preposition does not (`nut for
bolt`), and a number of a standard does (DIN 912 is a screw, DIN 125 a washer).
"""

from __future__ import annotations

import re
import unicodedata
from enum import Enum


class Says(Enum):
    """What a name says of a part: that it is a SCREW; that it may be one (`cover_M3x10`), which its
    shape then tells; NOTHING; or that it is some OTHER part."""

    SCREW = 2
    PERHAPS = 1
    NOTHING = 0
    OTHER = -1


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


def _numbers(text: str) -> frozenset[int]:
    return frozenset(map(int, text.split()))


DIN = _numbers(
    "84 85 95 96 97 186 188 261 316 404 417 427 438 444 464 465 478 479 480 525 529 551 553 558"
    " 561 564 571 580 601 603 604 605 607 608 609 610 653 787 797 835 906 908 909 910 912 913 914"
    " 915 916 920 921 922 923 925 926 927 931 933 938 939 940 949 960 961 963 964 965 966 967 968"
    " 975 976 2509 2510 6332 6367 6378 6379 6900 6901 6902 6912 6914 6921 6922 7380 7500 7504"
    " 7505 7513 7516 7964 7968 7969 7970 7971 7972 7973 7976 7981 7982 7983 7984 7985 7990 7991"
    " 7992 7995 7996 7997 7998 7999 34800 34801 34802 34803 34804 34805 34806 34821 34822 34823"
    " 34824 34827 82101"
)
"""Numbers of DIN standards of screws, bolts and studs."""

ISO = _numbers(
    "1207 1479 1481 1482 1483 1580 2009 2010 2342 2702 3266 3506 4014 4015 4016 4017 4018 4026"
    " 4027 4028 4029 4162 4762 4766 7045 7046 7047 7048 7049 7050 7051 7053 7379 7380 7411 7412"
    " 7434 7435 7436 7437 7438 8676 8677 8678 8765 10509 10510 10642 10644 12474 13918 14579"
    " 14580 14581 14582 14583 14584 14585 14586 14587 15071 15072 15480 15481 15482 15483 21269"
    " 23429 1662 1665"
)
"""Numbers of ISO and EN standards of screws, bolts and studs; EN 24014 is ISO 4014."""

STANDARD = re.compile(
    r"\b(?:(din) ?(\d{1,6})|(en|iso|din en|en iso|din iso|din en iso) ?(\d{3,6}))(?: \d)?\b"
)
"""DIN 912, DIN EN ISO 4762, ISO 7380-1."""

SIZE = re.compile(r"\bm ?\d{1,2}(?:[., ]\d{1,2})? ?x ?\d+(?:[., ]\d+)?(?: ?x ?\d+(?:[.,]\d+)?)?\b")
"""A thread and a length: M3x10, M8x1.25x30."""

THREAD = re.compile(r"\bm ?\d{1,2}(?:[.,]\d+)?\b")

PREPOSITIONS = _words(
    "for with of to in on at from without fuer fur mit von zu zur zum an am auf ohne pour avec"
    " de du des par para con del por per di da della voor met"
)

SCREW = re.compile(
    r"(?:\w*(?:screws?|bolts?|schrauben?|schroef|schroeven|skruv|skrue)|\w*gewindestifte?|grub|"
    r"shcs|bhcs|fhcs|vis|boulons?|goujons?|tornillos?|pernos?|prisioneros?|esparragos?|vite|viti|bullon[ei]|"
    r"parafusos?|srub[ay]?|sroub|wkret|vida|bout|bouten|gewindebolzen|stehbolzen|schraubbolzen)"
)
"""Nouns for screws."""

NO_SCREW = _words(
    "leadscrew ballscrew jackscrew airscrew corkscrew deadbolt thunderbolt kickbolt luftschraube"
    " schiffsschraube flugschraube"
)
"""Nouns that end like those for screws, and are none."""

NOT_BEFORE = _words(
    "lead ball jack feed power door dead latch sliding archimedes conveyor no non anti un"
)
"""Words before a noun for a screw with which it may be something else."""

DOUBTFUL = _words(
    "stud studs bolzen fastener fasteners gewindestange gewindestangen grano spindel threaded"
)
"""Nouns for parts that may be screws."""

PLACES = re.compile(
    r"\w*(?:plates?|platten?|deckel|covers?|lids?|gehaeuse|gehause|housings?|halter|holders?)|base|"
    r"body|bracket|block|frame|rahmen|panels?|flansch|tapa|couvercle|coperchio"
)
"""Nouns for parts that a screw may be named after, with its size: `cover_M3x10`."""

OTHERS = re.compile(
    PLACES.pattern + r"|\w*(?:nuts?|washers?|muttern?|scheiben?|zahnrad|bush(?:es|ings?)?|"
    r"bearing|buchse|huelse|hulse|drivers?|dreher|zieher|stopfen|nieten?|rivets?|federring|"
    r"sicherungsring|sprengring|einsatz|einsaetze)|\w*(?<!gewinde)stifte?|rings?|pins?|dowels?|"
    r"inserts?|standoffs?|spacers?|sleeves?|circlips?|clips?|keys?|holes?|loch|circles?|"
    r"patterns?|terminals?|wrench|knobs?|handles?|wheels?|gears?|pinions?|shafts?|axles?|"
    r"plugs?|valves?|pistons?|rollers?|pulleys?|springs?|magnets?|welle|achse|griff|knopf|"
    r"ventil|kolben|rolle|feder|lager|ecrous?|rondelles?|goupilles?|tuercas?|arandelas?|"
    r"pasador(?:es)?|dad[oi]|rondell[ae]|spin[ae]|antenn[ae]|propeller"
)
"""Nouns for other parts, some of which look like screws."""

MORE = _words(
    "left right top bottom upper lower front rear back inner outer middle mid center centre side"
    " corner north south east west links rechts oben unten vorne hinten mitte innen aussen first"
    " second third last drive driven driving idle idler short long kurz lang small large big klein"
    " gross thin thick lh rh copy kopie instance inst no nr num number part body solid component"
    " comp mesh object obj stl steel stainless inox zinc brass messing stahl black schwarz silver"
    " nylon galvanized verzinkt hex hexagon hexagonal torx allen inbus phillips pozi pozidriv"
    " slotted recessed tx pz ph sw pan flat button cheese countersunk csk senkkopf zylinderkopf"
    " linsenkopf sechskant innensechskant mm inch unc unf grade class type typ standard std din"
    " iso en bs chc fhc thc jis gost uni ansi asme a b c d e f g h i j k l m n o p q r s t u v w x"
    " y z"
)
"""Words that say more of what a noun names."""

HEAD = re.compile(r"\b(?:pan|flat|hex|button|cheese|round|socket|countersunk|cap|dome|low) head\b")


def says(name: str) -> Says:
    """What a name says of its part."""
    text = _plain(name)
    standards, sized, threaded = STANDARD.findall(text), SIZE.search(text), THREAD.search(text)
    text = HEAD.sub(" ", THREAD.sub(" ", SIZE.sub(" ", STANDARD.sub(" ", text))))
    words = _before_prepositions(re.findall(r"[a-z]+", text))
    nouns = [n for n, word in enumerate(words) if word not in MORE]
    last = words[nouns[-1]] if nouns else ""
    if OTHERS.fullmatch(last):
        return Says.PERHAPS if sized and PLACES.fullmatch(last) else Says.OTHER
    if standards:
        return Says.SCREW if any(_is_screw(*one) for one in standards) else Says.OTHER
    screws = [n for n in nouns if SCREW.fullmatch(words[n]) and words[n] not in NO_SCREW]
    if screws[-1:] == nouns[-1:] and not {*words[: nouns[-1] if nouns else 0][-1:]} & NOT_BEFORE:
        return Says.SCREW if nouns or sized else Says.PERHAPS if threaded else Says.NOTHING
    doubtful = screws or threaded or sized or any(words[n] in DOUBTFUL for n in nouns)
    return Says.PERHAPS if doubtful else Says.NOTHING


def _plain(name: str) -> str:
    """A name in lower case, its words apart, without accents."""
    text = name.replace("ß", "ss").translate(str.maketrans("äöüÄÖÜ×*", "aouAOUxx"))
    text = unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()
    text = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    text = re.sub(r"(?<=[A-Za-z]{2})(?=\d)|(?<=\d)(?=[A-Za-wyzA-WYZ]{2})", " ", text)
    return re.sub(r"[^a-z0-9.,]+", " ", text.lower())


def _before_prepositions(words: list[str]) -> list[str]:
    """The words that say what a part is, not what it is for."""
    end = next((n for n, word in enumerate(words) if n and word in PREPOSITIONS), len(words))
    return words[:end]


def _is_screw(din: str, number: str, iso: str, other: str) -> bool:
    """Whether a standard is one of screws."""
    n = int(number or other)
    return n in DIN if din else n in ISO or n - 20000 in ISO
