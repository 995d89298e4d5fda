"""The function ``compare_models``: every candidate is identified from the same rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._compare.comparison import ModelComparison
from tvident._identify import WeakForm, identify
from tvident._results import Identification
from tvident._status import Status
from tvident._units import ROTARY, axis_of

_CANDIDATES: dict[str, dict[str, Any]] = {
    "undamped": {"damping": 0.0, "terms": ("offset",)},
    "damped, no offset": {"terms": ()},
    "damped": {"terms": ("offset",)},
    "cubic": {"terms": ("offset", "cubic")},
    "gravity": {"terms": ("offset", "gravity")},
    "coulomb": {"terms": ("offset", "coulomb")},
    "quadratic_drag": {"terms": ("offset", "quadratic_drag")},
    "cubic, coulomb": {"terms": ("offset", "cubic", "coulomb")},
    "gravity, coulomb": {"terms": ("offset", "gravity", "coulomb")},
}


@arguments.called_as("compare_models(angle, torque, sample_rate=1000)")
def compare_models(
    angle: npt.ArrayLike,
    torque: npt.ArrayLike,
    *,
    models: Mapping[str, Mapping[str, Any]] | None = None,
    sample_rate: float | tuple[float, float] | None = None,
    delta: float | tuple[float, float] | None = None,
    t: npt.ArrayLike | tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
    **common: Any,
) -> ModelComparison:
    r"""Compare candidates for the equation of motion on one record.

    Every model is identified in weak form with the same test function, so that all explain the same rows: that of the model with most
    terms that the record distinguishes. The criterion is equation (8) of
    the paper, AICc = N ln(mean square of the residuals) + 2 k N/(N - k - 1), where N is the effective number of overlapping rows and k
    counts parameters (a windowed one as often as there are windows) and the variance.

    Parameters
    ----------
    angle, torque : array_like, shape (n,)
        One record, in rad and N m.
    models : mapping of str to mapping, optional
        Arguments of :func:`tvident.identify` by the model's name: ``{"spring": {"terms": ()}, "hard": {"terms": ("cubic",)}}``. By default
        with and without damping, offset, and cubic, gravity and Coulomb terms and quadratic drag; without gravity where the axis slides.
    sample_rate : float or (float, float)
        Samples per second, or those of angle and torque. Give exactly one of `sample_rate`, `delta` and `t`.
    delta : float or (float, float)
        Sample period in seconds.
    t : array_like, shape (n,), or tuple of two
        Time of every sample in seconds, or the times of the angle and those of the torque.
    common : optional
        Arguments of :func:`tvident.identify` for all models, such as ``stiffness="constant"`` or ``mask=``. A model's own win.

    Returns
    -------
    ModelComparison
        ``table``, ``best``, ``averaged``, ``results``; ``summary()`` says it in words.

    Raises
    ------
    ValueError
        If there are several records, fewer than two models, or a form other than the weak one; and as in :func:`tvident.identify`.
    TypeError
        If models are no mapping of mappings.

    Notes
    -----
    The cost is that of ``identify`` for every model, and once more: 1 to 15 µs a sample for each. Inner parameters of terms
    (``"stribeck"``, ``Term(search=)``) are searched in every model that has them, and count as parameters. Weights compare the models that
    are given: if none of them holds, one is still the best. ``results[best].summary()`` says what it explains.

    See Also
    --------
    identify : identifies each model, and looks for terms that one of them lacks.

    References
    ----------
    K. P. Burnham, D. R. Anderson: Model selection and multimodel inference, 2nd edition, Springer 2002: weights, unconditional errors.
    M. S. Bartlett: Some aspects of the time-correlation problem, Journal of the Royal Statistical Society 98 (1935): effective numbers.

    Examples
    --------
    >>> import tvident
    >>> rig = tvident.simulate_torsional_rig(duration=3.0)
    >>> models = {"with damping": {}, "without": {"damping": 0}}
    >>> compared = tvident.compare_models(rig.angle, rig.torque, models=models, sample_rate=1000)
    >>> compared.best
    'with damping'
    """
    if any(isinstance(one, tuple) for one in (sample_rate, delta, t)):
        angles = arguments.channel("angle", angle)
    else:
        angles, _ = arguments.channels(angle=angle, torque=torque)
    if sample_rate is None and delta is None and t is None:
        t = arguments.implied_times(angle)
    if angles.ndim != 1:
        raise ValueError(f"models are compared on a single record; got shape {angles.shape}; compare one at a time")
    candidates = _candidates(angle, torque, common) if models is None else models
    if not isinstance(candidates, Mapping) or not all(isinstance(one, Mapping) for one in candidates.values()):
        raise TypeError(
            f"models must be a mapping of names to arguments; got {arguments.shown(models)}; write "
            "{'damped': {}, 'friction': {'terms': ['offset', 'coulomb']}}, say"
        )
    if len(candidates) < 2:  # noqa: PLR2004 - a comparison
        raise ValueError(f"a comparison needs two models or more; got {len(candidates)}; add another")
    time = {"sample_rate": sample_rate, "delta": delta, "t": t}
    calls = {str(name): {**common, **one} for name, one in candidates.items()}
    method = _common_form(calls)
    if "auto" in (method.window_length, method.exponent):
        chosen = _richest_of_the_determined(angle, torque, {**time, "method": method}, calls).settings
        method = replace(method, window_length=chosen["window_length"], exponent=chosen["exponent"])
    results: dict[str, Identification] = {
        name: identify(angle, torque, **{**time, **call, "method": method}) for name, call in calls.items()
    }
    # With two clocks, rows are on the grid of both.
    samples = next(iter(results.values())).time.size
    return ModelComparison(results, round(samples * float(np.isfinite(angles).mean())))


def _candidates(angle: npt.ArrayLike, torque: npt.ArrayLike, common: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return what is compared where nothing is given: gravity turns what turns alone, and is an offset of what slides."""
    said = {name: common[name] for name in ("angle_unit", "torque_unit") if name in common}
    if axis_of(angle, torque, **said).system is ROTARY:
        return _CANDIDATES
    return {name: call for name, call in _CANDIDATES.items() if "gravity" not in call["terms"]}


def _richest_of_the_determined(
    angle: npt.ArrayLike, torque: npt.ArrayLike, common: Mapping[str, Any], calls: Mapping[str, Mapping[str, Any]]
) -> Identification:
    """Return what was identified with the model of most terms that the record distinguishes, or with that of most terms.

    What a record does not determine chooses no test function for models that it does: friction in one direction is an offset.
    """
    first: Identification | None = None
    for call in sorted(calls.values(), key=lambda call: -len(call.get("terms") or ())):
        found: Identification = identify(angle, torque, **{**common, **call, "method": common["method"]})
        if not Status(int(found.record_status)) & (Status.RANK_DEFICIENT | Status.ILL_CONDITIONED):
            return found
        first = first or found
    return found if first is None else first


def _common_form(calls: Mapping[str, Mapping[str, Any]]) -> WeakForm:
    """Return the weak form that all models share."""
    forms = [
        WeakForm() if arguments.is_word(call.get("method", "auto"), "auto") else call["method"]
        for call in calls.values()
    ]
    for form in forms:
        if not isinstance(form, WeakForm) or form != forms[0]:
            raise ValueError(
                f"all models must have the same weak form, or their rows differ; got {arguments.shown(form)}; give one WeakForm as method="
            )
    return forms[0]
