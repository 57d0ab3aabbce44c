"""Choosing a modification: sizing rules, gradient and evolutionary optimization, iterated and free-form flanks."""

from ..numerics import CVaR as CVaR
from ..numerics import Mean as Mean
from ..numerics import Quantile as Quantile
from ..numerics import Worst as Worst
from .evolution import CMAES as CMAES
from .evolution import DifferentialEvolution as DifferentialEvolution
from .evolution import Genetic as Genetic
from .factorial import Factorial as Factorial
from .first_order import Adam as Adam
from .free_form import free_form as free_form
from .goal import QUANTITIES as QUANTITIES
from .goal import Candidate as Candidate
from .goal import Constraint as Constraint
from .iteration import iterate_transmission_error as iterate_transmission_error
from .methods import METHODS as METHODS
from .minimax import Minimax as Minimax
from .minimize import minimize as minimize
from .pareto import Pareto as Pareto
from .projection import Projection as Projection
from .projection import project as project
from .quasi_newton import LBFGS as LBFGS
from .result import Front as Front
from .result import Iterate as Iterate
from .result import Optimum as Optimum
