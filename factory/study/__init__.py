"""Studies of many runs: pace, fidelity, sweeps."""
