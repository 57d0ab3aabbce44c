"""The tables of modifications and curves: the keys are the fields of the class."""

from typing import Annotated, Any

from .. import microgeometry
from .kinds import Choice, ListOf, Real, Table
from .layout import Section

Tables = dict[str, Any]
_NUMBER = Real()
_VALUE = Real(open=True)


class _Plain(Section):
    """A curve without numbers."""


class _PowerCurve(Section):
    exponent: Annotated[Any, _VALUE]


class _ThreeCoefficients(Section):
    b0: Annotated[Any, _VALUE]
    b1: Annotated[Any, _VALUE]
    b2: Annotated[Any, _VALUE]


class _PolynomialCurve(Section):
    coefficients: Annotated[list, ListOf(_VALUE)]


class _ParabolicLinearCurve(Section):
    node: Annotated[Any, _VALUE]


class _SplineCurve(Section):
    values: Annotated[list, ListOf(_VALUE)]


class _Amount(Section):
    amount: Annotated[Any, _VALUE]


class _Relief(Section):
    amount: Annotated[Any, _VALUE]
    length: Annotated[Any, _VALUE]
    curve: Annotated[Tables | None, Table()] = None


class _EndRelief(_Relief):
    side: Annotated[str | None, Choice(("both", "negative", "positive"))] = None


class _TabulatedProfile(Section):
    position: Annotated[list[float], ListOf(_NUMBER)]
    amount: Annotated[list, ListOf(_VALUE)]
    coordinate: Annotated[str | None, Choice(("roll_length", "roll_angle"))] = None
    method: Annotated[str | None, Choice(("linear", "cubic2", "monotonic"))] = None


# `type` of a curve or modification -> its class in the library and its keys. The keys are the fields of the class.
CURVES: dict[str, tuple[type[microgeometry.AbstractCurve], type[Section]]] = {
    "linear": (microgeometry.Linear, _Plain),
    "parabolic": (microgeometry.Parabolic, _Plain),
    "parabolic_linear": (microgeometry.ParabolicLinear, _ParabolicLinearCurve),
    "power": (microgeometry.Power, _PowerCurve),
    "quadratic": (microgeometry.Quadratic, _ThreeCoefficients),
    "polynomial": (microgeometry.Polynomial, _PolynomialCurve),
    "sinusoidal": (microgeometry.Sinusoidal, _ThreeCoefficients),
    "spline": (microgeometry.Spline, _SplineCurve),
}
MODIFICATIONS: dict[str, tuple[type[microgeometry.AbstractModification], type[Section]]] = {
    "tip_relief": (microgeometry.TipRelief, _Relief),
    "root_relief": (microgeometry.RootRelief, _Relief),
    "profile_crowning": (microgeometry.ProfileCrowning, _Amount),
    "profile_slope": (microgeometry.ProfileSlope, _Amount),
    "lead_crowning": (microgeometry.LeadCrowning, _Amount),
    "lead_slope": (microgeometry.LeadSlope, _Amount),
    "end_relief": (microgeometry.EndRelief, _EndRelief),
    "tabulated_profile": (microgeometry.TabulatedProfile, _TabulatedProfile),
}
UNITS = {"amount": "um", "length": "mm"}  # of the keys that a variable can stand for; the others are pure numbers
