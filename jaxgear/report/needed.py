"""The libraries of the extra `report`."""

import importlib


def needed(*modules: str) -> None:
    """Asks for libraries before long work begins.

    Args:
        modules: "jinja2" for a report, "xlsxwriter" for a workbook, "plotly" for a page of variants.

    Raises:
        ValueError: for the first that is not installed.
    """
    for module in modules:
        try:
            importlib.import_module(module)
        except ImportError:
            raise ValueError(f"--report needs the library {module}: pip install 'jaxgear[report]'") from None
