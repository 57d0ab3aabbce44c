"""Wear of the flanks, computed in blocks of revolutions."""

from .history import WearHistory as WearHistory
from .history import wear as wear
from .march import March as March
from .over_life import life_to as life_to
from .over_life import life_to_depth as life_to_depth
from .over_life import mean_over_life as mean_over_life
from .over_life import over_life as over_life
from .over_life import pressure_error as pressure_error
from .over_life import wear_depth as wear_depth
from .over_life import worn_volume as worn_volume
from .settings import WEAR_QUANTITIES as WEAR_QUANTITIES
from .settings import Wear as Wear
from .worn_volume import passage_depth as passage_depth
from .worn_volume import specific_sliding as specific_sliding
