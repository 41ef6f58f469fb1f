"""Reads a PNML file with pm4py: its nodes, arcs and marking, and whether it is a workflow net."""

import json
import sys


def main() -> None:
    from pm4py.objects.petri_net.importer import importer

    net, initial, _ = importer.apply(sys.argv[1])
    print(
        json.dumps(
            {
                "places": sorted(place.name for place in net.places),
                "transitions": sorted(transition.label for transition in net.transitions),
                "arcs": sorted([arc.source.name, arc.target.name] for arc in net.arcs),
                "marking": {place.name: count for place, count in initial.items()},
                "drawn": sum("layout_information_petri" in p.properties for p in net.places),
            }
        )
    )


if __name__ == "__main__":
    main()
