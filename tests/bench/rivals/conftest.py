"""Nothing here is imported by the tests: it needs the environment of its own."""

collect_ignore_glob = ["*.py"]
