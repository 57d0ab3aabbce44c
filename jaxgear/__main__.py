"""`python -m jaxgear` is the command line `jaxgear`."""

from .cli import main

main()
