"""The versions of this package, which is that in pyproject.toml, and of others."""

__version__ = "0.1.0"


def release(package: str) -> str:
    """The version of an installed package, "" where it is not installed."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(package)
    except PackageNotFoundError:
        return ""
