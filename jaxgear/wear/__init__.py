"""Wear: the flank as a state over its life."""

from .archard import passage_depth as passage_depth
from .archard import specific_sliding as specific_sliding
from .life import WearLife as WearLife
from .life import wear as wear
