"""The result of a comparison of models."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._compare.criterion import akaike_weights, averaged, effective_parameters
from tvident._equation import COEFFICIENTS
from tvident._files import aligned, write_table
from tvident._identify import aicc, effective_observations
from tvident._results import Identification
from tvident._status import DOUBTFUL_RECORD, Status

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array: TypeAlias = npt.NDArray[np.float64]

_ABOUT_EQUAL = 2.0
"""Models whose criteria differ by less are supported about equally (Burnham & Anderson)."""

_NO_SUPPORT = 10.0
"""A model whose criterion is higher than that of the best by more has essentially none (Burnham & Anderson)."""

_NO_WEIGHT = 1e-3
"""Models of less weight say nothing of their terms."""


class ModelComparison:
    r"""What :func:`tvident.compare_models` found. ``n`` is the number of samples.

    Attributes
    ----------
    results : dict of str to Identification
        What was identified with each model.
    table : dict of str to ndarray, shape (models,)
        ``"model"``, ``"parameters"`` (estimated, effective), ``"residual_std"`` (N m), ``"aicc"``, ``"difference"`` (from the best) and
        ``"weight"``; the best model first.
    best : str
        The model with the lowest criterion.
    averaged : dict of str to (value, stderr)
        Inertia, damping, stiffness and terms, averaged with the models' weights; zero in models that leave them out. Models that cannot
        tell their own parameters apart (ILL_CONDITIONED) are left out where another one has support. The errors know of
        the choice: they contain the spread between models. Numbers, or arrays of shape (n,) where a model lets them change.
    observations : float
        Effective number of observations.

    See Also
    --------
    compare_models : returns it.

    References
    ----------
    K. P. Burnham, D. R. Anderson: Model selection and multimodel inference, 2nd edition, Springer 2002: weights, unconditional errors.

    Examples
    --------
    >>> import tvident
    >>> rig = tvident.simulate_torsional_rig(duration=3.0)
    >>> compared = tvident.compare_models(rig.angle, rig.torque, sample_rate=1000)
    >>> value, error = compared.averaged["damping"]
    >>> bool(abs(value - 0.00825) < 4 * error)
    True
    """

    def __init__(self, results: Mapping[str, Identification], samples: int) -> None:
        self.results = dict(results)
        settings = next(iter(results.values())).settings
        self.observations = effective_observations(samples, settings["window_length"], settings["exponent"])
        squares = [_mean_square(result) for result in results.values()]
        counts = np.array([effective_parameters(result, samples) for result in results.values()])
        pairs = zip(squares, counts.tolist(), strict=True)
        # A model of which nothing was found has no score.
        scores = np.array(
            [aicc(square, self.observations, count) if math.isfinite(count) else math.inf for square, count in pairs]
        )
        weights = akaike_weights(scores)
        order = np.argsort(scores, kind="stable")
        names = list(results)
        self.best = names[int(order[0])]
        best = scores[order[0]]
        self.table: dict[str, npt.NDArray[Any]] = {
            "model": np.array(names)[order],
            "parameters": counts[order],
            "residual_std": np.sqrt(squares)[order],
            "aicc": scores[order],
            "difference": np.where(np.isfinite(scores), scores - (best if np.isfinite(best) else 0.0), np.inf)[order],
            "weight": weights[order],
        }
        self._twins = self._without_distinction()
        kept = weights * [name not in self._twins for name in names]
        self.averaged = {name: self._average(name, kept) for name in self._names()}

    def _without_distinction(self) -> list[str]:
        """Return models that do not tell their own parameters apart, where another one that does has support."""
        each = dict(zip(self.table["model"].tolist(), self.table["difference"].tolist(), strict=True))
        twins = [
            name
            for name, result in self.results.items()
            if Status(int(result.record_status)) & Status.ILL_CONDITIONED and math.isfinite(each[name])
        ]
        others = [difference for name, difference in each.items() if name not in twins]
        return twins if min(others, default=math.inf) < _NO_SUPPORT else []

    def _names(self) -> list[str]:
        terms = [name for result in self.results.values() for name in result.terms]
        return [*COEFFICIENTS, *dict.fromkeys(terms)]

    def _average(self, name: str, weights: Array) -> tuple[Any, Any]:
        """Return a parameter's mean over models and its error."""
        pairs = []
        for result in self.results.values():
            if name in result.constants:
                pairs.append(tuple(np.array([float(one)]) for one in result.constants[name]))
            elif name in COEFFICIENTS or name in result.terms:
                value = getattr(result, name) if name in COEFFICIENTS else result.terms[name]
                number = result.settings["known"].get(name)
                error = result.stderr[name]
                pairs.append((value[:1], error[:1]) if number is not None else (value, error))
            else:
                pairs.append((np.zeros(1), np.zeros(1)))
        size = max(value.size for value, _ in pairs)
        values, errors = (np.stack([np.broadcast_to(pair[part], size) for pair in pairs]) for part in (0, 1))
        mean, error = averaged(values, errors, weights)
        return (float(mean[0]), float(error[0])) if size == 1 else (mean, error)

    def summary(self) -> str:
        """Return tables of models and averaged parameters, and in words what they say.

        Returns
        -------
        str
            One line a model, the best first; one line a parameter; which models the record hardly distinguishes.

        See Also
        --------
        plot : the weights as a picture.
        Identification.summary : of one model.
        """
        head = ("model", "", "parameters", "residual std.", "AICc", "difference", "weight", "")
        rows: list[tuple[str, ...]] = [head]
        for place, name in enumerate(self.table["model"]):
            numbers = [f"{self.table[one][place]:.4g}" for one in ("parameters", "residual_std")]
            numbers += [f"{self.table['aicc'][place]:.1f}", f"{self.table['difference'][place]:.1f}"]
            rows.append((str(name), "", *numbers, f"{self.table['weight'][place]:.3f}", ""))
        lines = [f"{len(self.results)} models, {self.observations:.0f} effective observations", "", *aligned(rows), ""]
        units = next(iter(self.results.values())).units
        cells: list[tuple[str, ...]] = [("averaged", "", "median", "std. error", "unit")]
        idle = self._without_support()
        for name, (value, error) in ((name, pair) for name, pair in self.averaged.items() if name not in idle):
            numbers = (
                [f"{np.nanmedian(value):.5g}", f"{np.nanmedian(error):.2g}"]
                if np.isfinite(value).any()
                else ["nan", "nan"]
            )
            cells.append((name, "", *numbers, units.get(name, "")))
        lines += [*aligned(cells), ""]
        return "\n".join([*lines, self._words()])

    def _words(self) -> str:
        if not np.isfinite(self.table["aicc"][0]):
            return "the record does not determine any of these models"
        close = [str(name) for name in self.table["model"][self.table["difference"] < _ABOUT_EQUAL]]
        if len(close) == 1:
            words = [
                f"best: {close[0]}; its criterion is lower by {_ABOUT_EQUAL:g} or more than that of every other model"
            ]
        else:
            words = [
                f"the record hardly tells {_quoted(close)} apart: their criteria differ by less than {_ABOUT_EQUAL:g}"
            ]
        lost = [str(name) for name in self.table["model"][~np.isfinite(self.table["aicc"])]]
        if lost:
            words.append(f"the record does not determine {_quoted(lost)}")
        if self._twins:
            words.append(
                f"{_quoted(self._twins)} cannot tell its own parameters apart, so averages leave it out; see its advice"
                if len(self._twins) == 1
                else f"{_quoted(self._twins)} cannot tell their own parameters apart, so averages leave them out; see their advice"
            )
        idle = self._without_support()
        if idle:
            words.append(f"in no model that counts: {', '.join(idle)}")
        flags = Status(int(self.results[self.best].record_status))
        if flags & DOUBTFUL_RECORD:
            names = ", ".join(str(flag.name) for flag in flags & DOUBTFUL_RECORD)
            words.append(
                f"do not trust {self.best!r}, though it is the best: {names}; see results[{self.best!r}].advice"
            )
        elif flags & (Status.NOISE_MODEL | Status.COLOURED):
            words.append(
                f"what {self.best!r} leaves is no white noise, so differences of the criterion count for less than they seem to: another "
                f"term may be missing, see results[{self.best!r}].advice"
            )
        return "\n".join(words)

    def _without_support(self) -> list[str]:
        """Return terms that no model with some weight has."""
        counts = {
            str(name)
            for name, weight in zip(self.table["model"], self.table["weight"], strict=True)
            if weight > _NO_WEIGHT and name not in self._twins
        }
        kept = {term for name in counts for term in self.results[name].terms}
        return [name for name in self.averaged if name not in kept and name not in COEFFICIENTS]

    def save(self, path: str) -> None:
        """Write the table of models to a CSV or NPZ file.

        Parameters
        ----------
        path : str
            A name that ends in ``.csv`` or ``.npz``.

        Raises
        ------
        ValueError
            If the ending is another one.

        See Also
        --------
        to_pandas : the same table in memory.
        """
        write_table(path, self.table, {"residual_std": "N m"})

    def to_pandas(self) -> Any:
        """Return the table as a data frame whose index is the model.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        ImportError
            If pandas is missing.

        See Also
        --------
        save : the same table in a file.
        """
        try:
            import pandas as pd  # type: ignore[import-not-found,import-untyped,unused-ignore] # noqa: PLC0415 - optional
        except ImportError as error:
            raise ImportError(
                "to_pandas needs pandas, which is not installed; install it with: pip install pandas"
            ) from error
        return pd.DataFrame(self.table).set_index("model")

    def plot(self, *, ax: Axes | None = None) -> Figure:
        """Draw the weight of every model.

        Parameters
        ----------
        ax : Axes, optional
            Where to draw. By default a new figure.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        ImportError
            If matplotlib is missing: install ``tvident[plot]``.

        See Also
        --------
        summary : the numbers.
        """
        from tvident import _figures  # noqa: PLC0415 - matplotlib is optional

        return _figures.plot_models(self.table, ax)

    def __repr__(self) -> str:
        return f"<ModelComparison of {len(self.results)} models: best {self.best!r}>"


def _quoted(names: Sequence[str]) -> str:
    """Return names of models, which may hold commas, one after another."""
    return ", ".join(repr(name) for name in names)


def _mean_square(result: Identification) -> float:
    """Return the mean square of the residuals of the torque; infinite where nothing was determined."""
    residual = result.residual_std[np.isfinite(result.residual_std)]
    return float(np.mean(residual**2)) if residual.size else np.inf
