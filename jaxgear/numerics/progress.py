"""How long work tells how far it has come."""

from typing import Protocol


class Callback(Protocol):
    """Who wants to know how far a sweep or a search has come; an exception in it ends the work."""

    def __call__(self, done: int, total: int, best: float | None, /) -> None:
        """Is told the variants or steps done, all of them, and the best objective so far; None where none is sought."""
