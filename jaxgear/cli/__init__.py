"""The command line: `jaxgear analyze FILE.toml` and `jaxgear optimize FILE.toml`."""

from .app import main as main
