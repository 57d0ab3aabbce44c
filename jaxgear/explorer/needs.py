"""Libraries of the page, which are an extra."""

from importlib.util import find_spec

_NEEDS = "starlette", "uvicorn", "websockets", "plotly", "tomlkit"


def check_installed(asked: str) -> None:
    """Raise for a library that is missing.

    Args:
        asked: what needs it.

    Raises:
        ValueError: for the first that is not installed.
    """
    for module in _NEEDS:
        if find_spec(module) is None:
            raise ValueError(f"{asked} needs the library {module}: pip install 'jaxgear[explore]'")
