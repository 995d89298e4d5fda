"""The polynomials in windows that the angle's derivatives come from."""

from __future__ import annotations

from dataclasses import dataclass

from tvident import _arguments as arguments
from tvident import _core
from tvident._derivatives import SHORTEST_WINDOW, plan
from tvident._identify.columns import WINDOW_OF_TERMS
from tvident._identify.methods import Form, StrongForm


def odd_window(name: str, value: int | str, period: float, samples: int, *, least: int) -> int:
    """Return the samples of an odd window within a record."""
    length = arguments.window_length(name, value, period, odd=True)
    arguments.check_window(name, length, samples, least=least)
    return length


@dataclass(frozen=True)
class Polynomials:
    """The plan of a record's polynomials: those of the strong form, or short ones for terms in weak form.

    It knows nothing of the call that asks for it, which keeps it: both would wait for the collector of cycles.

    Parameters
    ----------
    form : Form
    period : float
    samples : int
    quantisation : float
    """

    form: Form
    period: float
    samples: int
    quantisation: float

    def __call__(self) -> _core.LocalPolynomials:
        """Return the plan."""
        if isinstance(self.form, StrongForm):
            form, value = self.form, self.form.window_length
            length = odd_window("window_length", value, self.period, self.samples, least=SHORTEST_WINDOW)
        else:
            form, length = StrongForm(), min(WINDOW_OF_TERMS, (self.samples - 1) // 2 * 2 + 1)
        return plan(
            length,
            order=None,
            max_order=form.max_order,
            criterion=form.criterion,
            selection=form.selection,
            derivatives=(0, 1, 2),
            delta=self.period,
            noise=True,
            quantisation=self.quantisation,
        )
