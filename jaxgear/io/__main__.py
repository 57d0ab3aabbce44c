"""`python -m jaxgear.io` prints every table and key of a design file."""

from .reference import reference

print(reference(), end="")
