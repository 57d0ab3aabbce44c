"""The command line: `jaxgear analyze FILE.toml`, `jaxgear optimize FILE.toml` and `jaxgear sweep FILE.toml`."""

from .app import main as main
