"""Runs that are continued from their log, or made again from its header."""
