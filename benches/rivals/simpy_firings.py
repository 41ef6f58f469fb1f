"""SimPy: a timed marked graph as a process for each transition: FILE FIRINGS.

FILE is JSON: for each place the transitions before and after it, its tokens, how long a token
stays [s], how long the first that is put stays, and when its initial tokens are there [s].
"""

import json
import sys
from collections.abc import Iterator
from time import process_time
from typing import Any

from simpy import AllOf, Environment, Event, Store


def simulated(net: dict[str, Any], count: int) -> list[list[float]]:
    """The dates of the first `count` firings of each transition [s]."""
    world = Environment()
    before: list[list[Store]] = [[] for _ in range(net["transitions"])]
    after: list[list[tuple[Store, float, float]]] = [[] for _ in range(net["transitions"])]
    for source, target, tokens, stay, first, ready in net["places"]:
        store = Store(world)
        for _ in range(tokens):
            world.process(_put(world, store, ready))
        before[target].append(store)
        after[source].append((store, stay, first))
    dates: list[list[float]] = [[] for _ in before]
    for number, own in enumerate(dates):
        world.process(_transition(world, before[number], after[number], own, count))
    world.run()
    return dates


def _transition(
    world: Environment,
    before: list[Store],
    after: list[tuple[Store, float, float]],
    dates: list[float],
    count: int,
) -> Iterator[Event]:
    """Takes a token of each place before it and puts one into each after it, `count` times."""
    for n in range(count):
        yield AllOf(world, [store.get() for store in before])
        dates.append(world.now)
        for store, stay, first in after:
            world.process(_put(world, store, stay if n else first))


def _put(world: Environment, store: Store, stay: float) -> Iterator[Event]:
    """A token that can be taken when it has stayed."""
    yield world.timeout(stay)
    yield store.put(None)


def main() -> None:
    with open(sys.argv[1]) as file:
        net = json.load(file)
    begin = process_time()
    dates = simulated(net, int(sys.argv[2]))
    print(json.dumps({"s": process_time() - begin, "dates": dates}))


if __name__ == "__main__":
    main()
