"""Control: navigation functions, the modes that are made of them, and the governor, which follows
their field within the limits of the robots."""
