"""The version of the installed package."""


def version() -> str:
    """Version of the package as text, also of code that is not installed."""
    from importlib import metadata

    try:
        return metadata.version("jaxgear")
    except metadata.PackageNotFoundError:
        return "unknown (not installed)"
