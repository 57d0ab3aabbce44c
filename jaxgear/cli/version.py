"""The versions of the installed package and of what it runs on."""

import platform


def version() -> str:
    """As text, of code that runs uninstalled too."""
    from importlib import metadata

    try:
        return metadata.version("jaxgear")
    except metadata.PackageNotFoundError:
        return "unknown (not installed)"


def versions() -> dict[str, str]:
    """Of everything that a result depends on, by name."""
    import jax
    import numpy

    return {
        "jaxgear": version(),
        "jax": jax.__version__,
        "numpy": numpy.__version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
    }
