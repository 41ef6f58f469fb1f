"""pm4py: the reachable markings of a net in PNML, until all are found or the time is over:
FILE SECONDS."""

import json
import sys
import traceback
from time import perf_counter

from pm4py.objects.petri_net.importer import importer
from pm4py.objects.petri_net.utils import reachability_graph
from reading import limited


def found_by(error: TimeoutError) -> int:
    """How many markings had been found. It looks at its own time limit between markings only, and
    may spend longer on one: so it is stopped in the middle, and what it has is read from there."""
    for frame, _ in traceback.walk_tb(error.__traceback__):
        if frame.f_code.co_name == "marking_flow_petri":
            return len(frame.f_locals["incoming_transitions"])
    return 0


def main() -> None:
    begin = perf_counter()
    stage, states, complete = "reading the net", 0, False
    try:
        with limited(float(sys.argv[2])):
            net, marking, _ = importer.apply(sys.argv[1], parameters={"progress_bar": False})
            stage = "states"
            states = len(reachability_graph.marking_flow_petri(net, marking)[0])
            complete = True
    except TimeoutError as error:
        states = found_by(error)
    seconds = perf_counter() - begin
    print(json.dumps({"states": states, "complete": complete, "s": seconds, "stage": stage}))


if __name__ == "__main__":
    main()
