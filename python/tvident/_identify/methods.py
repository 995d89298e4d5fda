"""The two forms of the equations, with their settings: what belongs to one form cannot be given to the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from tvident import _arguments as arguments
from tvident._choices import Criterion, Selection, Variation
from tvident._derivatives import HIGHEST_ORDER, SHORTEST_WINDOW
from tvident._identify.keywords import explained_form

SHORTEST_TEST_FUNCTION = 9
"""Samples."""
_LOWEST_EXPONENT, _HIGHEST_EXPONENT = 3, 20


@explained_form
@dataclass(frozen=True)
class WeakForm:
    """The weak form: the equation of motion multiplied by a test function and integrated by parts, so that no derivative is estimated.

    A setting that is ``"auto"`` is chosen from each record. Values are checked when the object is made.

    Parameters
    ----------
    window_length : int or str
        Length of the test function: an odd number of samples, at least 9, a duration such as ``"0.2 s"``, or ``"auto"``.
    exponent : int or "auto"
        Exponent p of the test function (1 - x²)^p, 3 to 20.
    regression_window : int or str
        Length of the window in which windowed parameters are estimated: samples, a duration, or ``"auto"``: the length
        with the smallest cross-validation error.
    averaging : bool
        Average windows of many lengths before, around and after each sample, weighted by their cross-validation errors nearby, and end
        them at jumps; if no parameter is windowed, weight the equations by the inverse of the covariance of their noise. False: one
        window around each sample, as long as the record where `regression_window` is not given, or ordinary least squares. True by
        default, but False if `regression_window` is given, because then windows of that length are meant.
    variation : {"auto", "constant", "linear"}
        How windowed parameters may change within a window; ``"auto"`` is linear.

    Raises
    ------
    ValueError
        If a length is even, too short or no duration, the exponent is not within 3 to 20, or a word is unknown.
    TypeError
        If a number is not whole, or `averaging` is neither True nor False.

    See Also
    --------
    StrongForm : the paper's form.
    identify : takes either as ``method=``.

    References
    ----------
    M. Shinbrot: On the analysis of linear and nonlinear systems, Transactions of the ASME 79 (1957): integration by parts moves the
    derivatives from the data to the test function.

    Examples
    --------
    >>> import tvident
    >>> tvident.WeakForm(regression_window="0.5 s")
    WeakForm(window_length='auto', exponent='auto', regression_window='0.5 s', averaging=False, variation='auto')
    >>> rig = tvident.simulate_torsional_rig(duration=3.0)
    >>> form = tvident.WeakForm(window_length=121, exponent=8)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method=form)
    >>> result.settings["window_length"]
    121
    """

    window_length: int | str = "auto"
    exponent: int | Literal["auto"] = "auto"
    regression_window: int | str = "auto"
    averaging: bool | None = None
    variation: Literal["auto"] | Variation = "auto"

    def __post_init__(self) -> None:
        checked = {"window_length": self.window_length, "regression_window": self.regression_window}
        if not arguments.is_word(self.window_length, "auto"):
            checked["window_length"] = arguments.length_given(
                "window_length", self.window_length, odd=True, least=SHORTEST_TEST_FUNCTION
            )
        if not arguments.is_word(self.regression_window, "auto"):
            checked["regression_window"] = arguments.length_given("regression_window", self.regression_window)
        _set(self, **checked, exponent=exponent_of(self.exponent))
        if self.averaging is None:
            _set(self, averaging=arguments.is_word(self.regression_window, "auto"))
        _set(self, averaging=arguments.flag("averaging", self.averaging))
        arguments.one_of("variation", self.variation, ("auto", *get_args(Variation)))


@explained_form
@dataclass(frozen=True)
class StrongForm:
    """The strong form, the paper's: derivatives of the angle by local polynomials, then least squares in a window around every sample.

    All defaults are those of the paper. Values are checked when the object is made.

    Parameters
    ----------
    window_length : int or str
        Window of the polynomials: an odd number of samples, at least 5, or a duration such as ``"0.2 s"``. With an ``instrument=`` the
        longest: windows half as long are taken while that makes the errors smaller, what polynomials smooth away among them.
    max_order : int
        Highest candidate order, at most 15. With an ``instrument=``, the order.
    criterion : {"aicc", "aicc-textbook", "aic", "bic"}
        Criterion that chooses the order, as in :func:`tvident.fit_local_polynomials`.
    selection : {"window", "pooled", "average"}
        How orders are chosen, as in :func:`tvident.fit_local_polynomials`: each window's own, one for neighbouring windows together, or
        all of them averaged.
    regression_window : int or str
        Length of the window in which windowed parameters are estimated: samples or a duration.
    filter_torque : bool
        Smooth the torque with polynomials of the orders chosen for the angle.
    variation : {"constant", "linear"}
        How windowed parameters may change within a window.

    Raises
    ------
    ValueError
        If a length is even, too short, ``"auto"`` or no duration, the order is above 15, or a word is unknown.
    TypeError
        If a number is not whole, or `filter_torque` is neither True nor False.

    See Also
    --------
    WeakForm : needs no derivatives, and chooses its settings from the record.
    identify : takes either as ``method=``.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.

    Examples
    --------
    >>> import tvident
    >>> rig = tvident.simulate_torsional_rig(duration=3.0)
    >>> form = tvident.StrongForm(window_length=151, selection="pooled")
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=1000, method=form)
    >>> result.settings["selection"]
    'pooled'
    """

    window_length: int | str = 201
    max_order: int = HIGHEST_ORDER
    criterion: Criterion = "aicc"
    selection: Selection = "window"
    regression_window: int | str = 200
    filter_torque: bool = False
    variation: Variation = "constant"

    def __post_init__(self) -> None:
        for name in ("window_length", "regression_window"):
            if arguments.is_word(getattr(self, name), "auto"):
                raise ValueError(
                    f"{name} must be a number of samples or a duration in strong form, where nothing chooses it; got 'auto'; "
                    f"give a length ({getattr(type(self), name)} in the paper), or use WeakForm"
                )
        order = arguments.whole_number("max_order", self.max_order, least=0)
        if order > HIGHEST_ORDER:
            raise ValueError(
                f"max_order must be at most {HIGHEST_ORDER}; got {order}; polynomials of a higher order do more harm than good"
            )
        length = arguments.length_given("window_length", self.window_length, odd=True, least=SHORTEST_WINDOW)
        rows = arguments.length_given("regression_window", self.regression_window)
        _set(self, window_length=length, max_order=order, regression_window=rows)
        arguments.one_of("criterion", self.criterion, get_args(Criterion))
        arguments.one_of("selection", self.selection, get_args(Selection))
        _set(self, filter_torque=arguments.flag("filter_torque", self.filter_torque))
        arguments.one_of("variation", self.variation, get_args(Variation))


Form: TypeAlias = WeakForm | StrongForm
Method: TypeAlias = Literal["auto", "paper"] | Form


def _set(form: Form, **values: object) -> None:
    """Set fields of a frozen object while it is made: numbers of NumPy's types become Python's."""
    for name, value in values.items():
        object.__setattr__(form, name, value)


def exponent_of(value: object) -> int | str:
    """Return the exponent of a test function, or "auto"."""
    if arguments.is_word(value, "auto"):
        return "auto"
    exponent = arguments.whole_number("exponent", value)
    if not _LOWEST_EXPONENT <= exponent <= _HIGHEST_EXPONENT:
        raise ValueError(
            f"exponent must be between {_LOWEST_EXPONENT} and {_HIGHEST_EXPONENT}; got {exponent}; "
            f"use {min(max(exponent, _LOWEST_EXPONENT), _HIGHEST_EXPONENT)}"
        )
    return exponent
