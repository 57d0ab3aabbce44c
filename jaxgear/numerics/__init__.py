"""Numerical tools without a gear word in them: fields, safe functions, quadrature, roots, complementarity, risk."""

from .complementarity import ContactProblem as ContactProblem
from .complementarity import ContactSolution as ContactSolution
from .complementarity import solve_contact as solve_contact
from .complementarity import tangent_stiffness as tangent_stiffness
from .fields import check as check
from .fields import concrete as concrete
from .fields import optional_real as optional_real
from .fields import real as real
from .fields import whole as whole
from .logarithm import log as log
from .quadrature import gauss_legendre as gauss_legendre
from .risk import AbstractMeasure as AbstractMeasure
from .risk import CVaR as CVaR
from .risk import Mean as Mean
from .risk import Quantile as Quantile
from .risk import Worst as Worst
from .root import bracketed_root as bracketed_root
from .safe import safe_divide as safe_divide
from .safe import safe_log as safe_log
from .safe import safe_power as safe_power
from .safe import safe_sqrt as safe_sqrt
from .spring import AbstractSpring as AbstractSpring
