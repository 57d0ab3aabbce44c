"""Conditions for the evaluation of designs: loads, manufactured gears, and measures over all cases."""

from .cases import Cases as Cases
from .cases import Conditions as Conditions
from .cases import LoadSpectrum as LoadSpectrum
from .cases import conditions as conditions
from .join import Better as Better
from .join import in_words as in_words
from .join import joined as joined
from .join import label as label
from .join import ranked as ranked
from .variant import Design as Design
from .variant import Modifications as Modifications
from .variant import Parameters as Parameters
from .variant import Variant as Variant
from .variant import Variants as Variants
from .variant import call_with as call_with
from .variant import cycle_status as cycle_status
from .variant import solve_case as solve_case
from .variant import solved as solved
from .variant import two_modifications as two_modifications
from .variant import variants as variants
