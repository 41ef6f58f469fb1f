"""What can be said of any net: with gears claimed, discovered or none, with choice or without."""

from __future__ import annotations

from collections.abc import Mapping

from factory.foreign_nets.behaviour import behaviour
from factory.foreign_nets.discover import discover
from factory.foreign_nets.explore import LIMIT
from factory.nets.composition import compose
from factory.nets.gears import GearNet
from factory.nets.marked import MarkedNet, marked
from factory.nets.verdict import Defect, Verdict, testify
from factory.nets.verify import gear_net_defects, gear_train_defects, legality_defects
from factory.support.collector import collector_paused
from factory.support.errors import Position


@collector_paused()
def analyse(
    net: GearNet | MarkedNet,
    sources: Mapping[str, Position] | None = None,
    limit: int = LIMIT,
) -> Verdict:
    """The verdict on a net that may come from elsewhere.

    Where it claims gears, these are checked as `verify` does; else those of a gear net are
    discovered. Without gears there is no legal marking to speak of: `legal` and `gear_train` are
    None. Linear in the net; only a net with
    choice is explored, up to `limit` markings. `sources`: as for `verify`.
    """
    against: tuple[Defect, ...] = ()
    train: bool | None = None
    if isinstance(net, MarkedNet) and not net.gears:
        gears, against = discover(net)
        net = net.with_gears(gears) if gears else net
    subject = marked(net)
    if against:
        text = "undecided: a legal marking marks each gear once, and the net has no gears"
        found, legal = behaviour(subject, (), limit), None
        illegal: tuple[Defect, ...] = (Defect("legal", "undecided", text),)
    else:
        composition = compose(subject)
        against = gear_net_defects(net, composition)
        untrained = gear_train_defects(net, subject, composition)
        train = not untrained
        against += tuple(defect for defect in untrained if defect.property == "gear_train")
        found = behaviour(subject, composition.closed, limit)
        illegal = legality_defects(net, subject)
        legal = not illegal
    witness = testify(subject, (*against, *found.defects, *illegal), sources)
    return Verdict(
        not any(defect.property == "gear_net" for defect in against),
        found.live,
        found.safe,
        found.reversible,
        legal,
        witness,
        subject.gears,
        found.method,
        train,
    )
