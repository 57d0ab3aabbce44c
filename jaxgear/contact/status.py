"""Why a result counts or does not: one status for the results of all analyses."""

from collections import Counter
from collections.abc import Mapping, Sequence
from enum import IntEnum
from functools import reduce
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Int8


class Status(IntEnum):
    """Outcome of an analysis; of several causes the largest number counts, which is the most basic one.

    Arrays hold the numbers, so that a status can be traced, mapped, and reduced by its maximum.
    """

    CONVERGED = 0
    NOT_CONVERGED = 1
    NO_STEADY_MOTION = 2
    MORE_PAIRS_NEEDED = 3
    OUT_OF_VALIDITY = 4
    SUPPORT_NOT_POSSIBLE = 5
    GEARS_CANNOT_RUN = 6

    @property
    def text(self) -> str:
        """The cause in words."""
        return _TEXTS[self]

    @property
    def remedy(self) -> str:
        """Next step of the user, "" for `CONVERGED`."""
        return _REMEDIES[self]


_TEXTS = {
    Status.CONVERGED: "converged",
    Status.NOT_CONVERGED: "the iteration did not converge",
    Status.NO_STEADY_MOTION: "the motion does not converge to an orbit within the largest number of mesh cycles",
    Status.MORE_PAIRS_NEEDED: "tooth pairs beyond those of the mesh come into contact, more are needed",
    Status.OUT_OF_VALIDITY: "a number is out of its range, or out of the validity of the model or the support",
    Status.SUPPORT_NOT_POSSIBLE: "shafts, bearings or housing are invalid",
    Status.GEARS_CANNOT_RUN: "the gears cannot run: their teeth are invalid, have no backlash, or are worn through",
}

_REMEDIES = {
    Status.CONVERGED: "",
    Status.NOT_CONVERGED: "raise newton_steps of the resolution, or narrow the bounds of the variables",
    Status.NO_STEADY_MOTION: "raise the largest number of mesh cycles",
    Status.MORE_PAIRS_NEEDED: "leave pairs of the resolution open, or raise it",
    Status.OUT_OF_VALIDITY: "compare values and bounds of the variables with the ranges of the fields that they set",
    Status.SUPPORT_NOT_POSSIBLE: "correct the data of shafts, bearings or housing",
    Status.GEARS_CANNOT_RUN: "change teeth, profile shift, tip diameter, centre distance or backlash",
}

Statuses = Int8[Array, "..."]


class WithStatus:
    """A result with a status: an array of the numbers of `Status` in its field `status`."""

    status: Any

    @property
    def converged(self) -> Any:
        """Whether the status is `Status.CONVERGED`, bools of the shape of the status."""
        return self.status == Status.CONVERGED.value


def status_of(causes: Mapping[Status, Bool[Array | np.ndarray, "..."] | bool], *parts: Statuses) -> Statuses:
    """The status of a result; `CONVERGED` where there is none of the causes.

    Args:
        causes: for every cause where it is met, arrays of bools that broadcast against each other.
        parts: statuses of what the result is made of, to be broadcast likewise.
    """
    met = (jnp.asarray(where).astype(jnp.int8) * jnp.int8(cause.value) for cause, where in causes.items())
    return reduce(jnp.maximum, (*met, *parts))


def reason(status: Statuses | np.ndarray | Sequence[Statuses]) -> str:
    """The text of the most basic cause in a concrete array of statuses."""
    return Status(int(np.max(np.asarray(status)))).text


def tally(status: Statuses | np.ndarray) -> dict[Status, int]:
    """Number of failures by their status, the commonest first; empty where everything has converged.

    Args:
        status: numbers of `Status` of any shape, concrete.
    """
    counts = Counter(np.asarray(status).ravel().tolist())
    return {Status(number): count for number, count in counts.most_common() if number != Status.CONVERGED}


def explanation(failures: Mapping[Status, int], total: int, noun: str, pairs: int | None = None) -> str:
    """The commonest failure with its remedy: "18,474 of 20,000 variants: tooth pairs ...: leave pairs ... open".

    Args:
        failures: as `tally` gives them, at least one.
        total: number of results, failed or not.
        noun: plural of what has failed, such as "variants".
        pairs: tooth pairs of the mesh; None where they are not known.
    """
    status, count = next(iter(failures.items()))
    further = f" to at least {pairs + 1}" if pairs and status is Status.MORE_PAIRS_NEEDED else ""
    return f"{count:,} of {total:,} {noun}: {status.text}: {status.remedy}{further}"
