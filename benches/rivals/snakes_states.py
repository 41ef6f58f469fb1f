"""SNAKES: the state graph of a net in PNML, until it is complete or the time is over:
FILE SECONDS."""

import json
import sys
from time import perf_counter

from reading import limited, net
from snakes.nets import PetriNet, Place, StateGraph, Transition, Value, dot


def loaded(path: str) -> PetriNet:
    """The net with one black token for each token."""
    tokens, transitions, arcs = net(path)
    found = PetriNet("net")
    for name, count in tokens.items():
        found.add_place(Place(name, [dot] * count))
    for name in transitions:
        found.add_transition(Transition(name))
    for source, target in arcs:
        if source in tokens:
            found.add_input(source, target, Value(dot))
        else:
            found.add_output(target, source, Value(dot))
    return found


def main() -> None:
    begin = perf_counter()
    stage, states, complete = "reading the net", 0, False
    graph = None
    try:
        with limited(float(sys.argv[2])):
            petri = loaded(sys.argv[1])
            stage = "states"
            graph = StateGraph(petri)
            graph.build()
            complete = True
    except TimeoutError:
        pass
    states = len(graph) if graph is not None else 0
    seconds = perf_counter() - begin
    print(json.dumps({"states": states, "complete": complete, "s": seconds, "stage": stage}))


if __name__ == "__main__":
    main()
