"""Under what a design is judged: loads, manufactured gears, and how the cases are joined into one number."""

from .cases import Cases as Cases
from .cases import cases as cases
from .load import LoadSpectrum as LoadSpectrum
