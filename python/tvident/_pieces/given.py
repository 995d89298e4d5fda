"""What a call gives to every part of a long record that is identified as a record of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tvident import _arguments as arguments
from tvident._identify import Held, Method, Span, WeakForm, estimate_part, identify_part
from tvident._results import Estimates, Identification
from tvident._units import ROTARY, Axis


@dataclass(frozen=True)
class Given:
    """Arguments of a call.

    Parameters
    ----------
    method : Method
    equation : mapping
        Parameters, terms, lag and quantisation.
    settings : mapping, optional
        Of an earlier result.
    nan_policy : str
    period : float
        Seconds from one sample to the next.
    axis : Axis
    workers : int, optional
    weighted : bool
        Samples have weights.
    """

    method: Method
    equation: Mapping[str, Any]
    settings: Mapping[str, Any] | None
    nan_policy: arguments.RowPolicy
    period: float
    axis: Axis
    workers: int | None
    weighted: bool = False

    @property
    def frozen(self) -> Mapping[str, Any] | None:
        """Settings of an earlier result that all parts take as they are; None where a form is given beside them."""
        return self.settings if arguments.is_word(self.method, "auto") else None

    def identified(
        self,
        held: Held,
        report: Any = None,
        *,
        chosen: Mapping[str, Any] | None = None,
        step: int = 1,
        wanted: Span | None = None,
        diagnose: bool | None = None,
    ) -> Identification:
        """Identify a part, with what was chosen for the whole record if anything was.

        Parameters
        ----------
        held : Held
        report : callable, optional
        chosen : mapping, optional
            Settings that all parts take as they are.
        step : int
        wanted : (int, int), optional
            The samples of the record that the part is identified for; its others are neighbours.
        diagnose : bool, optional
            Look for what may be missing in the equation. Without it, where nothing was chosen for the whole record: what is said of
            stretches from which that was chosen is said of the recording.
        """
        if diagnose is None:
            diagnose = chosen is None or self.frozen is not None
        return identify_part(held, self._options(chosen, step), wanted, report, diagnose=diagnose)

    def estimated(
        self, held: Held, *, chosen: Mapping[str, Any] | None, step: int, wanted: Span, diagnose: bool = False
    ) -> Estimates:
        """Identify a part as :meth:`identified` does, and return its numbers alone."""
        return estimate_part(held, self._options(chosen, step), wanted, diagnose=diagnose)

    def _options(self, chosen: Mapping[str, Any] | None, step: int) -> dict[str, Any]:
        """Return the arguments of a part, with what was chosen for the whole record if anything was."""
        equation: dict[str, Any] = {name: value for name, value in self.equation.items() if value is not None}
        method, settings = self.method, self.settings
        if chosen is not None:
            # What was chosen is in the settings; what was given to choose from is not asked again.
            equation = {} if settings is None else equation
            # Nor is the length of windows that predicts best, which a record of its own would choose anew.
            method, settings = (
                "auto" if isinstance(method, WeakForm) else method,
                {
                    **chosen,
                    "chosen": [one for one in chosen["chosen"] if one == "lag"],
                },
            )
            if self.weighted:
                # It is that of a sample of the record's mean weight, which is not that of a part.
                settings.pop("shown_noise", None)
        units: dict[str, Any] = {} if self.axis.system is ROTARY else {"angle_unit": "m", "torque_unit": "N"}
        return {
            "delta": self.period,
            "method": method,
            "settings": settings,
            "nan_policy": self.nan_policy,
            "step": step,
            "workers": self.workers,
            **units,
            **equation,
        }
