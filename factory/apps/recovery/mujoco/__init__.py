"""Faults and recovery in the engine."""
