"""What is recorded of a run: its log, and the monitor that judges it from its states."""
