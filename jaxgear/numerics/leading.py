"""Functions of one thing, used on many: leading batch axes of a Module are mapped where the function is called."""

from functools import wraps

import equinox as eqx


def over_batch(function):
    """Maps a function over the leading batch axes of its first argument, which tells their number as `batch_ndim`.

    A Module made by `jax.vmap` has the batch axes in front of every array; the function sees arrays without them, and
    what it returns has them in front again. Other arguments are the same for all.
    """

    @wraps(function)
    def mapped(first, *args, **options):
        def of_one(one):
            return function(one, *args, **options)

        for _ in range(first.batch_ndim):
            of_one = eqx.filter_vmap(of_one)
        return of_one(first)

    return mapped
