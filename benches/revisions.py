"""What stays of factories in the next revision of a product, over random edits.

python -m benches.revisions FILE.pag ...                      # trees: robots, programs, contents
python -m benches.revisions --pin [--only add] FILE.pag ...   # layouts: place, module, cycle time
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from factory.apps.revise.pins import StayingRobot
from factory.apps.revise.revision import revised
from factory.engine.timing.timed import pace
from factory.pipeline import all_templates, read
from factory.support.errors import RunError
from factory.theory.lang.pag_reader import load_pag
from tests.revisions import KINDS, edited, kept_share, shuffled


def main(files: Sequence[str]) -> None:
    """Print the table: 20 random edits each of 1, 3 and 10, and with all labels renamed."""
    for file in files:
        pag, row = load_pag(file, all_templates()), []
        for count, renamed in ((1, False), (3, False), (10, False), (0, True), (1, True)):
            total = Counter[str]()
            for seed in range(20):
                rng = random.Random(seed * 31 + count)
                new = edited(pag, rng, count)
                total += kept_share(pag, shuffled(new, rng) if renamed else new)
            shares = (
                f"{100 * total[name] / total['old']:.0f}"
                for name in ("paired", "program", "contents")
            )
            row.append(f"{count} edits{', renamed' * renamed}: {', '.join(shares)} %")
        print(f"{pag.root}: {'; '.join(row)}", flush=True)


def pinned(files: Sequence[str], kinds: Sequence[str], count: int = 20) -> None:
    """Print what single edits leave of layouts: in place, of the same module, and the cycle time
    over that of a layout made afresh."""
    for file in files:
        old = read(file)
        height = round(float(old.product.high[2] - old.product.low[2]), 3)
        kept, ratios, less, seed = list[StayingRobot](), list[float](), 0, 700
        while len(ratios) < count and seed < 900:
            new = edited(old.pag, random.Random(seed), 1, kinds, height)
            seed += 1
            if new == old.pag:
                continue
            try:
                fresh = replace(old, pag=new).layout
            except RunError:
                continue
            found = revised(old, replace(old, pag=new))
            less += found.pinned != "all"
            kept += found.kept
            cycles = (pace(made, old.settings)[0].seconds for made in (found.new.layout, fresh))
            ratios.append(next(cycles) / next(cycles))
        place, module = (
            100 * sum(getattr(robot, grade) for robot in kept) / len(kept)
            for grade in ("place", "module")
        )
        print(
            f"{old.pag.root}, {len(ratios)} edits ({', '.join(kinds)}): in place {place:.1f} %,"
            f" module {module:.1f} %, cycle {sum(ratios) / len(ratios):.3f} of afresh, at most"
            f" {max(ratios):.3f}; {less} with less pinned",
            flush=True,
        )


if __name__ == "__main__":
    words = sys.argv[1:]
    if words[:1] == ["--pin"]:
        only = words[2:3] if words[1:2] == ["--only"] else []
        pinned(words[3:] if only else words[1:], only or KINDS)
    else:
        main(words)
