"""An independent checker of what `build -o` writes about clearance: no two machines ever meet.

It knows nothing of layouts and of the search for them. It takes the model in MJCF, the coordinated
net in PNML, the ways of the machines and the pairs that come near, each with its circuit.
"""
