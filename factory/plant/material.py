"""Stub."""
def joins_of(factory):
    return {o.end: (o.start, *(factory.by_label[x].end for x in o.inputs)) for o in factory.operations}
