"""Identification of a second-order system whose parameters change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from tvident import _core, arguments
from tvident.collected import Collected
from tvident.derivatives import Criterion, plan, quantisation_step
from tvident.missing import missing, propagate
from tvident.progress import reporter
from tvident.reasons import Explained, Words
from tvident.result import Identification
from tvident.settings import Form, Preset, Selection, Variation, resolve
from tvident.strong_reasons import ExplainedStrong
from tvident.terms import COEFFICIENTS, Kind, Parameter, Term, TermName, Unknown, all_terms, parameter

_SHORTEST_WINDOW = 5
_SHORTEST_TEST_FUNCTION = 9
_WINDOW_OF_TERMS = 51
"""Samples of the polynomials that terms of one's own get angle and velocity from in weak form."""


def identify(
    angle: npt.ArrayLike,
    torque: npt.ArrayLike,
    *,
    sample_rate: float | None = None,
    delta: float | None = None,
    t: npt.ArrayLike | None = None,
    preset: Preset = "auto",
    window_length: int | str | None = None,
    max_order: int | None = None,
    criterion: Criterion | None = None,
    selection: Selection | None = None,
    form: Form | None = None,
    exponent: int | str | None = None,
    equations: int | str | None = None,
    variation: Variation | None = None,
    inertia: Parameter | None = None,
    damping: Parameter | None = None,
    stiffness: Parameter | None = None,
    terms: Sequence[TermName | Term | tuple[TermName | Term, Kind]] | None = None,
    filter_torque: bool | None = None,
    lag: float | Literal["auto"] | None = None,
    quantisation: float | None = None,
    mask: npt.ArrayLike | None = None,
    step: int = 1,
    nan_policy: arguments.RowPolicy = "omit",
    settings: Mapping[str, Any] | None = None,
    workers: int | None = None,
    progress: arguments.Progress = None,
) -> Identification:
    r"""Identify I(t), C(t) and K(t) in I θ̈ + C θ̇ + K θ = T from a recorded angle and torque.

    In weak form, the default, the equation is multiplied by a test function φ = (1 - x²)^p that vanishes with its slope at both ends of
    a window, and integrated by parts: I⟨φ″θ⟩ - C⟨φ′θ⟩ + K⟨φθ⟩ = ⟨φT⟩. No derivative is ever estimated, what the angle's noise does to
    the equations is taken off, and whatever is not given is chosen from the record: ``summary()`` says what and why.

    In strong form, the paper's, the angle is fitted by polynomials of every order in a window around every sample, Akaike's criterion
    chooses one (equations (2), (8) and (9) of the paper) and gives θ̇ and θ̈; in another window of 200 such equations the unknowns are
    solved for by least squares ((3) and (4)).

    Parameters
    ----------
    angle : array_like, shape (\*, n)
        Angle in rad. Time is the last axis; any others are a batch of records.
    torque : array_like, same shape
        Torque in N m.
    sample_rate : float
        Samples per second. Give exactly one of `sample_rate`, `delta` and `t`.
    delta : float
        Sample period in seconds.
    t : array_like, shape (n,)
        Time of every sample in seconds, uniform to a thousandth of the sample period.
    preset : {"auto", "paper"}, optional
        What is used where nothing is given. ``"auto"``: weak form, everything chosen from the record, inertia and damping constant
        unless it says otherwise, an offset of the torque. ``"paper"``: the paper's method, windows of 201 samples and 200 equations.
    window_length : int or str, optional
        Samples of the test function, or in strong form of the window of the polynomials: odd, a duration such as ``"0.2 s"``, or
        ``"auto"`` in weak form; 201 in the paper.
    max_order : int, optional
        Highest candidate order of the strong form; 15 in the paper.
    criterion : {"aicc", "aicc-textbook", "aic", "bic"}, optional
        What chooses the order in strong form, as in :func:`tvident.fit_local_polynomials`.
    selection : {"auto", "window", "pooled", "average"}, optional
        In strong form, how orders are chosen, as in :func:`tvident.fit_local_polynomials`: each window's own (the paper), one for
        neighbouring windows together (``"auto"``), or all of them averaged. In weak form, where what is windowed comes from:
        ``"window"`` takes one window of `equations` around each sample; ``"average"`` (``"auto"``) averages windows of many lengths
        before, around and after it by how well each predicts nearby, and ends them at jumps; giving `equations` means
        ``"window"``. Where nothing is windowed, ``"window"`` means ordinary least squares, and ``"average"`` those weighted by the
        inverse of the noise's covariance, unless that fails to explain what is left.
    form : {"strong", "weak", "auto"}, optional
        The paper's equations, or those of the test function. ``"auto"`` always takes the latter: with the same kinds of parameters
        it was the more accurate in every case measured, 1.4 to 55 times for stiffness and 2.8 to 78 times for inertia.
    exponent : int or str, optional
        Exponent p of the test function, 3 to 20, or ``"auto"``; 8 with the paper's preset.
    equations : int or str, optional
        Samples whose equations are solved together, a duration, or ``"auto"`` in weak form: the length of windows that predicts best
        what they have not seen; 200 in the paper.
    variation : {"constant", "linear"}, optional
        How what is windowed may change within a window.
    inertia, damping, stiffness : {"windowed", "constant", "auto", "varying"}, float or array_like, optional
        ``"windowed"``: unknown, one value for every sample. ``"constant"``: unknown, one value for the record. ``"auto"``: constant unless
        the record says otherwise (windowed, for stiffness). ``"varying"``: changes more slowly than what is windowed (weak form). A
        number or an array of the angle's shape: known; 0 leaves it out.
    terms : sequence, optional
        What else stands on the left-hand side, with an unknown factor: ``"offset"``, ``"coulomb"`` (the sign of the velocity), ``"cubic"``
        (the cube of the angle) or a :class:`Term` of one's own; or a pair of one of these and its kind. Without a kind a term is
        windowed where all unknown parameters are, and constant otherwise.
    filter_torque : bool, optional
        In strong form: smooth the torque with polynomials of the orders chosen for the angle.
    lag : float or "auto", optional
        Seconds by which the torque was recorded late; fractions of a sample count. ``"auto"``, in weak form: the lag nearest to none at
        which the torque's rate explains nothing more, with its standard error in ``settings["lag_stderr"]``; none where the record does
        not tell it from the damping, as with motion at a single frequency.
    quantisation : float, optional
        Step to which the angle was rounded, in rad: an encoder's count. In strong form no residual is taken to be smaller than it
        leaves, in weak form no noise. By default it is looked for in the samples, as in :func:`tvident.fit_local_polynomials`, but not in
        strong form with the paper's preset, whose criterion has no such bound. 0 means none.
    mask : array_like of bool, shape (n,) or the angle's, optional
        True where a sample may be the centre of an equation.
    step : int, optional
        Every how many samples a result is wanted.
    nan_policy : {"omit", "propagate", "raise"}, optional
        What to do about values of angle and torque that are no finite numbers. ``"omit"``: they cost their own equations only; numbers
        around them are taken from the other equations of their window and flagged GAP. ``"propagate"``: what is windowed is NaN where
        its window holds one. ``"raise"``: refuse them.
    settings : mapping, optional
        Settings of an earlier result: what it chose is used again. What is given beside them wins. `mask`, `step` and what was known
        at every sample are not among them.
    workers : int, optional
        Threads; by default ``TVIDENT_WORKERS`` or all processors that this process may use. The numbers do not depend on it.
    progress : bool or callable, optional
        Show a bar, or call a function with the samples done and all of them. What it raises cancels the work.

    Returns
    -------
    Identification
        ``inertia``, ``damping``, ``stiffness``, ``stderr``, ``condition``, ``status`` and more; ``summary()`` says it in words.

    Raises
    ------
    ValueError
        If shapes differ, a window is even or does not fit, `t` is not uniform, nothing is unknown, a name is unknown, or a setting
        belongs to the other form.
    TypeError
        If an array is complex or holds no numbers, or there is no sample period.

    Notes
    -----
    Within 0.2 s inertia and stiffness are nearly collinear unless several frequencies are excited: under a single sine they cannot be
    told apart at all. ``condition`` says so, and ``stderr`` by how much.

    Standard errors of the strong form follow from how far windows scatter that share no equation: see :class:`Identification`. Those of
    the weak form follow from the known covariance of its overlapping rows, times the mean squared error of predicting rows that were
    not seen, over the noise's.

    In strong form, where all unknowns are of one kind, the cost is some 60 ns a sample and thread, whatever the windows, and memory is
    that of the results, but for terms of one's own, which need the derivatives of the whole record. In weak form and where kinds are
    mixed it is some 1 to 15 µs a sample, the most where it jumps, and the equations of the whole record are kept.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: identification of a time-varying mechanical system using the Akaike information criterion.

    Examples
    --------
    >>> import numpy as np
    >>> import tvident
    >>> t = np.arange(4000) / 1000
    >>> angle = 0.2 * np.sin(2 * np.pi * 2 * t) + 0.1 * np.sin(2 * np.pi * 7 * t)
    >>> velocity, acceleration = np.gradient(angle, t), np.gradient(np.gradient(angle, t), t)
    >>> torque = 0.01 * acceleration + 0.05 * velocity + 15 * angle
    >>> result = tvident.identify(angle, torque, sample_rate=1000)
    >>> bool(abs(result.stiffness[2000] - 15) < 0.01)
    True
    >>> paper = tvident.identify(angle, torque, sample_rate=1000, preset="paper")
    >>> bool(abs(paper.stiffness[2000] - 15) < 0.01)
    True
    """
    angles = arguments.real_array("angle", angle)
    torques = arguments.real_array("torque", torque)
    if angles.shape != torques.shape:
        raise ValueError(
            f"angle and torque must have the same shape; got {angles.shape} and {torques.shape}; cut or reshape one of them"
        )
    samples = angles.shape[-1]
    if sample_rate is None and delta is None and t is None:
        raise TypeError("identify needs the sample period; got none; give sample_rate=, delta= or t=")
    period = arguments.sample_period(samples, delta=delta, sample_rate=sample_rate, t=t)
    given = {
        "window_length": window_length,
        "max_order": max_order,
        "criterion": criterion,
        "selection": selection,
        "form": form,
        "exponent": exponent,
        "equations": equations,
        "variation": variation,
        "inertia": inertia,
        "damping": damping,
        "stiffness": stiffness,
        "terms": terms,
        "filter_torque": filter_torque,
        "lag": lag,
        "quantisation": quantisation,
    }
    used = resolve(preset, given, settings)
    rounded = used["quantisation"]
    used["quantisation"] = quantisation_step(angles, rounded)
    for name, array in (("angle", angles), ("torque", torques)):
        arguments.check_nan(name, array, nan_policy, arguments.RowPolicy)
    lags = used["lag"] if isinstance(used["lag"], tuple) else (used["lag"],)
    for late in lags:
        if late != "auto" and abs(late) >= samples * period:
            raise ValueError(
                f"lag must be shorter than the record of {samples * period:.6g} s; got {late:.6g} s; "
                "give it in seconds, or align the channels"
            )
    start = 0.0 if t is None else float(np.asarray(t)[0])
    task = _Task(
        angles=angles,
        torques=torques,
        time=start + np.arange(samples, dtype=np.float64) * period,
        period=period,
        settings=used,
        rounded=rounded,
        holes=missing(angles, torques),
        propagate=nan_policy == "propagate",
        mask=arguments.mask("mask", mask, angles.shape),
        step=arguments.whole_number("step", step, least=1),
        workers=arguments.worker_count(workers),
        parameters={name: parameter(name, used[name], angles.shape) for name in COEFFICIENTS},
    )
    return task.weak(progress) if used["form"] == "weak" else task.strong(progress)


@dataclass
class _Task:
    """One call: what is to be identified from what, and how."""

    angles: npt.NDArray[np.number]
    torques: npt.NDArray[np.number]
    time: npt.NDArray[np.float64]
    period: float
    settings: dict[str, Any]
    rounded: float | None
    holes: npt.NDArray[np.bool_] | None
    propagate: bool
    mask: npt.NDArray[np.bool_] | None
    step: int
    workers: int | None
    parameters: dict[str, Kind | float | npt.NDArray[np.number]]

    def __post_init__(self) -> None:
        kinds: dict[str, Kind] = {name: value for name, value in self.parameters.items() if isinstance(value, str)}
        default: Kind = "windowed" if all(kind == "windowed" for kind in kinds.values()) else "constant"
        self.extra = all_terms(self.settings["terms"], default)
        self.unknowns = [Unknown(name, kind) for name, kind in kinds.items()] + self.extra
        if not self.unknowns:
            raise ValueError(
                "at least one parameter must be unknown; all are given; use 'windowed' or 'constant' for one"
            )

    def strong(self, progress: arguments.Progress) -> Identification:
        """Identify in strong form."""
        samples, used = self.time.size, self.settings
        length = arguments.window_length("window_length", used["window_length"], self.period, odd=True)
        arguments.check_window("window_length", length, samples, least=_SHORTEST_WINDOW)
        rows = arguments.window_length("equations", used["equations"], self.period, odd=False)
        core_plan = self._plan(length)
        untested = [one.name for one in self.unknowns if one.kind == "auto" and _in_strong_form(one) == "constant"]
        self.unknowns = [Unknown(one.name, _in_strong_form(one), one.own) for one in self.unknowns]
        kinds = {unknown.kind for unknown in self.unknowns}
        found = Collected(self.angles.shape[:-1], [unknown.name for unknown in self.unknowns])
        options: dict[str, Any] = {"step": self.step, "workers": self.workers}
        if "windowed" in kinds:
            arguments.check_window("equations", rows, samples, least=len(self.unknowns) + 1)
        motions = self._motions(core_plan)
        plain = not used["filter_torque"] and used["lag"] == 0 and self.mask is None
        whole = self.holes is None or self.propagate
        with reporter(progress, "identification") as report:
            options["progress"] = report
            if plain and whole and kinds == {"windowed"} and used["variation"] == "constant":
                found.windowed(core_plan, motions, rows, **options)
            elif plain and kinds == {"constant"}:
                found.constant(core_plan, motions, **options)
            else:
                options |= {"filter_torque": used["filter_torque"], "lag": used["lag"] / self.period}
                options |= {"linear": used["variation"] == "linear", "equations": rows}
                words = [unknown.kind for unknown in self.unknowns]
                each = [
                    _core.identify_strong(core_plan, motions, record, words, mask=self._mask(record), **options)
                    for record in range(self._records)
                ]
                found.records(each, self._numbers)
                if self.propagate and self.holes is not None:
                    propagate(found, self.holes, [(length, rows)] * self._records, self.step)
        chosen = {"chosen": (), "window_length": length, "exponent": None, "equations": rows}
        explained = ExplainedStrong(
            values=found.values,
            errors=found.errors,
            covariances=found.covariances,
            factors=found.factors,
            kinds={unknown.name: unknown.kind for unknown in self.unknowns},
            untested=untested,
            condition=found.condition,
            order=found.order,
            status=found.status,
            settings=used | {"window_length": length},
            mask=None if self.mask is None else self.mask[..., :: self.step],
        )
        return self._result(found, chosen, explained.words())

    def weak(self, progress: arguments.Progress) -> Identification:
        """Identify in weak form."""
        samples, used = self.time.size, self.settings
        lengths = [self._length(value) for value in self._each("window_length")]
        equations = [self._equations(value) for value in self._each("equations")]
        exponents = [
            None if value == "auto" else arguments.whole_number("exponent", value) for value in self._each("exponent")
        ]
        average = used["selection"] != "window"
        kinds = self._weak_kinds(average=average)
        own = any(unknown.own is not None for unknown in self.extra)
        core_plan = self._plan(min(_WINDOW_OF_TERMS, (samples - 1) // 2 * 2 + 1)) if own else None
        motions = self._motions(core_plan)
        lags = [None if lag == "auto" else lag / self.period for lag in self._each("lag")]
        present = [unknown.name for unknown in self.extra] + ([] if used["lag"] == 0 else ["lag"])
        if not isinstance(self.parameters["stiffness"], str):
            # A cubic spring beside a known one is not a question that anybody asked.
            present.append("cubic")
        found = Collected(self.angles.shape[:-1], [unknown.name for unknown in self.unknowns])
        with reporter(progress, "identification") as report:
            each = [
                _core.identify_weak(
                    motions,
                    record,
                    kinds,
                    delta=self.period,
                    half_width=None if length is None else length // 2,
                    exponent=exponent,
                    equations=rows,
                    average=average,
                    linear=used["variation"] == "linear",
                    lag=lag,
                    quantisation=self.rounded,
                    mask=self._mask(record),
                    step=self.step,
                    not_missing=present,
                    workers=self.workers,
                    progress=report,
                )
                for record, (length, exponent, rows, lag) in enumerate(
                    zip(lengths, exponents, equations, lags, strict=True)
                )
            ]
        found.records(each, self._numbers)
        if self.propagate and self.holes is not None:
            reached = [(2 * one["half_width"] + 1, one["equations"]) for one in each]
            propagate(found, self.holes, reached, self.step)
        names = dict(zip(self._numbers, (unknown.name for unknown in self.unknowns), strict=True))
        tested = [one.name for one in self.unknowns if one.kind == "auto"]
        asked = {"window_length": lengths, "exponent": exponents, "equations": equations}
        automatic = tuple(name for name, values in asked.items() if None in values)
        automatic += ("lag",) if used["lag"] == "auto" else ()
        explained = [Explained(one, names, automatic, tested, self.period) for one in each]
        words = [one.words(form_chosen=used["form_chosen"]) for one in explained]
        chosen: dict[str, Any] = {
            "chosen": automatic,
            "window_length": tuple(2 * one["half_width"] + 1 for one in each),
            "exponent": tuple(one["exponent"] for one in each),
            "equations": tuple(one["equations"] for one in each),
        }
        if used["lag"] == "auto":
            known = [one["lag"] or (0.0, np.nan) for one in each]
            late, error = (tuple(lag[place] * self.period for lag in known) for place in (0, 1))
            chosen |= {"lag": late, "lag_stderr": error}
        if len(each) == 1:
            chosen |= {name: value[0] for name, value in chosen.items() if name != "chosen"}
            slow = {names[number] for number in each[0]["changing"]} & set(COEFFICIENTS)
            self.unknowns = [Unknown(one.name, _in_the_end(one, slow), one.own) for one in self.unknowns]
        else:
            # What is constant in some records and changes in others stays to be tested in each.
            self.unknowns = [
                Unknown(one.name, "constant" if one.name in found.constants else one.kind, one.own)
                for one in self.unknowns
            ]
        return self._result(found, chosen, words[0] if len(words) == 1 else _of_batch(words))

    def _each(self, name: str) -> Sequence[Any]:
        """Return a setting of every record: the same for all, or what an earlier call chose for each."""
        value = self.settings[name]
        if not isinstance(value, tuple | list):
            return [value] * self._records
        if len(value) != self._records:
            raise ValueError(
                f"{name} must be one number, or one for each of the {self._records} records; got {len(value)}; "
                "give settings of a result with as many records"
            )
        return value

    def _length(self, value: int | str) -> int | None:
        """Return the samples of a test function, None for those that are to be chosen."""
        if value == "auto":
            return None
        length = arguments.window_length("window_length", value, self.period, odd=True)
        arguments.check_window("window_length", length, self.time.size, least=_SHORTEST_TEST_FUNCTION)
        return length

    def _equations(self, value: int | str) -> int | None:
        """Return the samples of a window of equations, None for those that are to be chosen."""
        if value == "auto":
            return None
        rows = arguments.window_length("equations", value, self.period, odd=False)
        arguments.check_window("equations", rows, self.time.size, least=len(self.unknowns) + 1)
        return rows

    @property
    def _records(self) -> int:
        return int(np.prod(self.angles.shape[:-1], dtype=int))

    @property
    def _numbers(self) -> list[int]:
        """What the core calls the unknowns: coefficients by their place, then the terms."""
        unknown = [place for place, name in enumerate(COEFFICIENTS) if isinstance(self.parameters[name], str)]
        return unknown + [len(COEFFICIENTS) + place for place in range(len(self.extra))]

    def _weak_kinds(self, *, average: bool) -> list[str]:
        """Return the kinds by the words of the core."""
        words: list[str] = []
        several = any(one.kind == "windowed" for one in self.unknowns if one.name not in {"inertia", "damping"})
        for one in self.unknowns:
            kind: str = one.kind
            if kind == "auto":
                kind = "windowed" if one.name == "stiffness" else "auto"
            if average and several and kind == "windowed" and one.name in {"inertia", "damping"}:
                # In windows short enough for the stiffness they cannot be told from it.
                kind = "varying"
            if kind == "varying" and (not average or not several):
                kind = "windowed"
            words.append(kind)
        return words

    def _plan(self, length: int) -> _core.LocalPolynomials:
        return plan(
            length,
            order=None,
            max_order=arguments.whole_number("max_order", self.settings["max_order"], least=0),
            criterion=self.settings["criterion"],
            selection=self.settings["selection"] if self.settings["form"] == "strong" else "window",
            derivatives=(0, 1, 2),
            delta=self.period,
            noise=True,
            quantisation=self.settings["quantisation"],
        )

    def _motions(self, core_plan: _core.LocalPolynomials | None) -> _core.Motions:
        columns: list[npt.NDArray[np.number] | str] = [unknown.name for unknown in self.extra]
        if core_plan is not None and any(unknown.own is not None for unknown in self.extra):
            (angle, velocity, _), *_ = core_plan.estimate(self.angles, workers=self.workers)
            columns = [
                unknown.own.values(self.time, angle, velocity) if unknown.own else unknown.name
                for unknown in self.extra
            ]
        known = [None if isinstance(value, str) else value for value in self.parameters.values()]
        return _core.Motions(self.angles, self.torques, known, columns)

    def _mask(self, record: int) -> npt.NDArray[np.bool_] | None:
        if self.mask is None:
            return None
        return np.ascontiguousarray(self.mask.reshape(-1, self.time.size)[record])

    def _result(self, found: Collected, chosen: Mapping[str, Any], words: Words) -> Identification:
        known = {name: value for name, value in self.parameters.items() if not isinstance(value, str)}
        found.add_known(known, self.step)
        kinds: dict[str, str] = dict.fromkeys(COEFFICIENTS, "known")
        kinds |= {unknown.name: unknown.kind for unknown in self.unknowns}
        used = self.settings
        same = (
            "preset",
            "form",
            "max_order",
            "criterion",
            "selection",
            "variation",
            "filter_torque",
            "lag",
            "quantisation",
        )
        terms = tuple((one.own or one.name, one.kind) for one in self.unknowns if one.name not in COEFFICIENTS)
        jumps: tuple[Any, ...] = tuple(tuple(self.time[samples].tolist()) for samples in found.jumps)
        return Identification(
            time=self.time[:: self.step],
            values=found.values,
            errors=found.errors,
            covariances=found.covariances,
            factors=found.factors,
            constants=found.constants,
            terms=[unknown.name for unknown in self.extra],
            condition=found.condition,
            residual_std=found.residual_std,
            order=found.order,
            status=found.status,
            jumps=jumps if found.status.ndim > 1 else jumps[0],
            settings={
                **{name: used[name] for name in same},
                "sample_rate": 1 / self.period,
                "order": None,
                **chosen,
                "kinds": kinds,
                "terms": terms,
                "known": {name: value if isinstance(value, float) else None for name, value in known.items()},
                "step": self.step,
                "reasons": words.reasons,
                "advice": words.advice,
            },
        )


def _of_batch(each: Sequence[Words]) -> Words:
    """Return the advice of every record; reasons differ too much from one to the next."""
    return Words((), tuple(f"record {record}: {line}" for record, words in enumerate(each) for line in words.advice))


def _in_strong_form(unknown: Unknown) -> Kind:
    """Return the kind of an unknown where nothing tests it."""
    if unknown.kind in {"windowed", "constant"}:
        return unknown.kind
    return "windowed" if unknown.name == "stiffness" or unknown.kind == "varying" else "constant"


def _in_the_end(unknown: Unknown, changing: set[str]) -> Kind:
    """Return the kind that an unknown turned out to be of."""
    if unknown.kind == "auto" and unknown.name != "stiffness":
        return "varying" if unknown.name in changing else "constant"
    return "windowed" if unknown.kind == "auto" else unknown.kind
