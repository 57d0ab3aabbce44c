"""Choosing a modification: sizing rules and gradient optimization."""

from .gradient import Optimum as Optimum
from .gradient import minimize as minimize
from .sizing import IsoStiffness as IsoStiffness
from .sizing import iso_relief as iso_relief
from .sizing import iso_stiffness as iso_stiffness
from .sizing import long_relief_length as long_relief_length
from .sizing import relief_amount as relief_amount
from .sizing import short_relief_length as short_relief_length
