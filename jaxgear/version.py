"""The version of the installed package."""


def version() -> str:
    """As text, of code that runs uninstalled too."""
    from importlib import metadata

    try:
        return metadata.version("jaxgear")
    except metadata.PackageNotFoundError:
        return "unknown (not installed)"
