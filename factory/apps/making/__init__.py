"""From a folder of CAD to a running cell in one command, made of the commands for each step."""
