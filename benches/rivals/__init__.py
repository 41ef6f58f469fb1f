"""What a user might pick instead: programs that drive one of them and print what they found as
JSON.

They are run with the Python of `.rivals`, which `tools/rivals` makes, and import nothing of ours.
"""
