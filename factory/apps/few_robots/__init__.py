"""Which robot does what: forms of operations, chosen for few robots and a cycle time."""
