"""Programs that read an export with somebody else's library and print what they found as JSON.

They are run with the Python of `.oracles`, which `tools/oracles` makes, and import nothing of ours.
"""
