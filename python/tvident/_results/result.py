"""The result of an identification."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._arguments import told_once, whole_number
from tvident._results.curve import ExpandedParameter
from tvident._results.estimates import Estimates
from tvident._results.held_back import HeldBack
from tvident._results.kept import comparisons
from tvident._results.oscillator import Oscillator
from tvident._results.parts import (
    At,
    RecordIndex,
    chosen,
    in_batch,
    of_records,
    of_samples,
    samples_between,
    settings_of,
)
from tvident._results.recorded import Recorded
from tvident._results.scan import Scan
from tvident._results.shown import Shown
from tvident._results.standard_errors import StandardErrors
from tvident._results.verdict import RECORDS, ExplainedTorque, distrusted
from tvident._results.words import Words, of_batch, with_written_over
from tvident._status import DOUBTFUL, DOUBTFUL_RECORD

Array: TypeAlias = npt.NDArray[np.float64]


@np.errstate(all="ignore")
def _product(factor: Array, error: Array) -> Array:
    """Return standard errors times their variance-inflation factor."""
    return np.broadcast_to(factor * told_once(error), error.shape)


class Identification(Shown):
    r"""What :func:`tvident.identify` found. ``n`` is the number of samples, or of every ``step``-th of them.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Seconds.
    inertia, damping, stiffness : ndarray of float64, shape (\*, n)
        Identified, constant or known values. NaN only where the status has INVALID.
    terms : dict of str to ndarray, shape (\*, n)
        Factors of further terms.
    constants : dict of str to (value, stderr)
        Parameters that are constant over the record, and inner parameters of terms, as ``"stribeck.velocity"`` or ``"reflex.delay"``;
        ``"angle_zero"``, in rad, where the spring is relaxed at another angle than zero.
    stderr : mapping of str to ndarray, shape (\*, n)
        Standard errors of all of these, ``"natural_frequency"`` and ``"damping_ratio"`` (by the delta method, with all covariances). In
        weak form they contain the correlation of overlapping equations and changes that windows cannot follow. In strong form they are
        those of ordinary least squares times one factor per record and parameter, from the scatter between windows that share no
        equation, or for constants from the covariance of the residuals. They do not contain a bias that all windows share: angle noise
        of 3 % and more biases inertia and stiffness downwards, and constants estimated from derivatives may have a bias of two or three
        standard errors.
    condition : ndarray, shape (\*, n)
        Condition number of the equations, their columns scaled to the same norm: large if parameters are nearly collinear.
    residual_std : ndarray, shape (\*, n)
        Standard deviation of the residuals of the torque.
    order : ndarray of uint8, shape (\*, n)
        Order of the polynomial around each sample; 0 in weak form, which has none.
    status : ndarray of uint16, shape (\*, n)
        Flags of :class:`tvident.Status` that hold at this sample: ``status == 0`` selects good samples.
    record_status : Status, or ndarray of uint16 in the shape of the batch
        Flags that hold for the whole record.
    jumps : tuple of float
        Times in seconds at which parameters jump (``reasons`` says which), found if windows of all lengths are averaged; one such
        tuple per record in a batch.
    expansions : dict of str to ExpandedParameter
        Parameters that were asked for as an :class:`Expansion`: the curve over what each is a function of, its error, and the sizes that
        were tried. Empty otherwise, and of a result that was loaded from a file.
    units : mapping of str to str
        Units of the parameters and of the columns by name: those of a rotary axis, or of a linear one (m, N).
    settings : dict
        Settings that were given and chosen, as plain JSON. ``identify(…, settings=result.settings)`` repeats it.

    See Also
    --------
    identify : returns it.
    Status : what the flags mean.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    W. K. Newey, K. D. West: A simple, positive semi-definite, heteroskedasticity and autocorrelation consistent covariance matrix,
    Econometrica 55 (1987): standard errors from the residuals.

    Examples
    --------
    >>> import tvident
    >>> rig = tvident.simulate_torsional_rig(duration=3.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate, inertia=0.0123)
    >>> bool(abs(result.stiffness[1500] / rig.stiffness[1500] - 1) < 0.02)
    True
    >>> sorted(result.stderr)
    ['damping', 'damping_ratio', 'inertia', 'natural_frequency', 'offset', 'stiffness']
    """

    def __init__(
        self,
        found: Estimates,
        *,
        time: Array,
        terms: Sequence[str],
        jumps: tuple[Any, ...],
        words: Words | Callable[[], Words],
        settings: dict[str, Any],
        recorded: Recorded | None = None,
    ) -> None:
        super().__init__(recorded)
        self._explained_each: Sequence[ExplainedTorque | None] | None = None
        """How much of the torque of every record is explained, of a result whose recording is not there."""
        self._share: tuple[float | None] | None = None
        """How much of the torque of the only record is explained, once that was asked."""
        self._whole: Identification | None = None
        """The result that this one is a part of."""
        self.expansions: dict[str, ExpandedParameter] = dict(found.expansions)
        self.units = found.units
        self.time = time
        self.inertia = found.values["inertia"]
        self.damping = found.values["damping"]
        self.stiffness = found.values["stiffness"]
        self.terms = {name: found.values[name] for name in terms}
        self.constants = dict(found.constants)
        self.condition = found.condition
        self.residual_std = found.residual_std
        self.order = found.order
        self.status = found.status
        self.record_status = found.record_status
        self.jumps = jumps
        self._words = words
        self.settings = settings
        self._found = found
        known = {name: error for name, error in found.errors.items() if name not in found.factors}
        computed: dict[str, Callable[[], Array]] = {
            name: partial(_product, factor, found.errors[name]) for name, factor in found.factors.items()
        }
        enlarged = StandardErrors(known, computed)
        self._oscillator = Oscillator(found, enlarged)
        derived = {
            "natural_frequency": self._oscillator.natural_frequency_error,
            "damping_ratio": self._oscillator.damping_ratio_error,
        }
        self.stderr = StandardErrors(known, computed | derived)

    @property
    def trusted(self) -> npt.NDArray[np.bool_]:
        r"""Where values can be trusted, shape (\*, n): the mask for plotting and averaging.

        True where every parameter is a finite number, where the sample's status has none of INVALID, RANK_DEFICIENT, ILL_CONDITIONED and
        NOISE_MODEL, and where that of the record has none of RANK_DEFICIENT, ILL_CONDITIONED and SCALES_DISAGREE; nowhere in a record
        whose summary begins with "do not trust" for another reason than that most samples are flagged: a sign that no machine has, too
        little of the torque explained, numbers that may mark missing values, another equation or form that finds other parameters. Of a
        batch its first hundred records are judged so; any other is judged when it is asked alone (``result[150].trusted``). Asking for
        the first time takes as long as the summary. Ask before you write into the arrays that were given, or give copies: where they
        hold other samples by then nobody can tell, nothing is trusted, and the verdict says so.

        See Also
        --------
        status, record_status : the flags that it combines.
        summary : begins with the verdict.

        References
        ----------
        docs/statuses.md, which is tested against this rule.
        """
        trusted = self._unflagged
        for place, reason in enumerate(self._distrusted):
            if reason is not None:
                trusted.reshape(-1, trusted.shape[-1])[place] = False
        return trusted

    @property
    def _unflagged(self) -> npt.NDArray[np.bool_]:
        """Where there are numbers, and flags do not forbid to trust them."""
        records = np.asarray(self.record_status)[..., np.newaxis]
        # NumPy takes a flag for a number of 64 bits.
        trusted = (self.status & np.uint16(DOUBTFUL) == 0) & (records & DOUBTFUL_RECORD == 0)
        for values in (self.inertia, self.damping, self.stiffness, *self.terms.values()):
            trusted &= np.isfinite(told_once(values))
        return np.asarray(trusted)

    @property
    def natural_frequency(self) -> Array:
        r"""Undamped natural frequency √(K/I)/2π in Hz, shape (\*, n); NaN where K/I is negative.

        See Also
        --------
        damping_ratio : the other half of the pole.
        stderr : has its error, by the delta method.

        References
        ----------
        Equation (j) of docs/mathematics.md.
        """
        return self._oscillator.natural_frequency

    @property
    def damping_ratio(self) -> Array:
        r"""Damping ratio C/(2√(KI)), shape (\*, n), without unit; NaN where KI is negative.

        See Also
        --------
        natural_frequency : the other half of the pole.
        stderr : has its error, by the delta method.

        References
        ----------
        Equation (j) of docs/mathematics.md.
        """
        return self._oscillator.damping_ratio

    @cached_property
    def _distrusted(self) -> tuple[str | None, ...]:
        """Why no sample of each record is to be trusted; a part of a record is what the whole is."""
        whole = self._whole
        return distrusted(self) if whole is None else whole._distrusted  # noqa: SLF001 - of this class

    @property
    def _distrusted_by_now(self) -> tuple[str | None, ...] | None:
        """What :attr:`trusted` goes by, where that was asked before: it may take as long as to identify."""
        found: tuple[str | None, ...] | None = (self._whole or self).__dict__.get("_distrusted")
        return found

    @property
    def _is_told(self) -> bool:
        """Whether nothing is tried any more before it is said what to do."""
        whole = self._whole or self
        recorded = whole._recorded  # noqa: SLF001 - of this class
        return "_told" in whole.__dict__ or recorded is None or recorded.improve is None

    def __getstate__(self) -> dict[str, Any]:
        """Return what a pickle keeps: words, and of a single record all that its summary says, without the recording.

        Of several records it keeps what decides the first line of the summary, and how much of held-back parts is explained only if that
        was asked for before (:meth:`summary`, :meth:`held_back`): that takes as long as to identify them.
        """
        self._explained_each = comparisons(self)
        if self.inertia.ndim == 1:
            self.held_back()
        # What finds the words knows the record.
        return super().__getstate__() | {"_words": self._told, "_distrusted": self._distrusted, "_whole": None}

    def __copy__(self) -> Identification:
        copied = object.__new__(type(self))
        copied.__dict__.update(self.__dict__)
        return copied

    @property
    def _explained_before(self) -> ExplainedTorque | None:
        """How much of the torque of the only record was explained where its recording was."""
        return self._explained_each[0] if self._explained_each and self.inertia.ndim == 1 else None

    # What to say is found when it is asked for: a short record is identified in less time than that takes.
    @cached_property
    def _chosen(self) -> Words:
        if isinstance(self._words, Words):
            return self._words
        recorded = self._recorded
        return self._words() if recorded is None or recorded.is_unchanged else with_written_over(Words())

    @cached_property
    def _told(self) -> Words:
        words = self._chosen
        recorded = self._recorded
        if recorded is None or recorded.improve is None:
            return words
        return recorded.improve(self, words) if recorded.is_unchanged else with_written_over(words)

    def scan(self, record: int = 0) -> Scan:
        """Return estimates by the width of the test function, which tell whether equations of every scale agree.

        Of a result of the strong form they are by the length of the polynomials' windows, with its other settings. They are made when they
        are asked for first, which costs about 4 µs for each of at most 262 144 samples, and nothing is moved: the window was given.

        Parameters
        ----------
        record : int, optional
            Which record of a batch, counted along its flattened axes.

        Returns
        -------
        Scan
            Estimates, errors and the band in Hz of every width; ``summary()`` and ``plot()`` show them.

        Raises
        ------
        ValueError
            If nothing was compared and the record is not there to do it, or an instrument was given.
        IndexError
            If there is no such record.
        TypeError
            If it is no whole number.

        See Also
        --------
        Scan : what it returns.
        record_status : has SCALES_DISAGREE where no widths agree.

        References
        ----------
        The rule is in docs/automatic.md, "Equations of every scale"; equation (C) weighs the widths.
        """
        if not self._found.scans:
            recorded = self._record("identify again, and ask for scan() before the result is saved or cut")
            if recorded.scans is None:
                raise ValueError(
                    "scan() compares equations without an instrument; this result has one; identify without it"
                )
            self._found = replace(self._found, scans=recorded.scans())
        scans = self._found.scans
        record = whole_number("record", record)
        if not -len(scans) <= record < len(scans):
            raise IndexError(f"record must be below {len(scans)}, the number of records; got {record}; count from 0")
        used = self.settings["window_length"] if self.settings["form"] == "strong" else None
        return replace(scans[record], units=self.units, used=used)

    def between(self, begin: At = None, end: At = None) -> Identification:
        """Return the part of the result from one time to another.

        Parameters
        ----------
        begin, end : float or date, optional
            Seconds, as in ``time``, or dates where the samples have these; both belong to the part. By default the first and the last.

        Returns
        -------
        Identification
            Views, no copies. Constants, settings, words and flags of the record are those of the whole.

        Raises
        ------
        ValueError
            If nothing lies in between.

        See Also
        --------
        tvident.identify : `mask=` identifies from a part of a recording alone.
        FileRecording.select : the same of a recording.
        """
        samples, first, last = samples_between(self.time, begin, end, self._found.labels)
        jumps = [
            tuple(jump for jump in one if first <= jump <= last)
            for one in (self.jumps if self.inertia.ndim > 1 else [self.jumps])
        ]
        part = Identification(
            of_samples(self._found, samples),
            time=self.time[samples],
            terms=list(self.terms),
            jumps=tuple(jumps) if self.inertia.ndim > 1 else jumps[0],
            words=lambda: self._told,
            settings=self.settings,
        )
        part._held_back = HeldBack(why_not="this is a part of a result; ask the whole")
        part._whole = self
        return part

    def __iter__(self) -> Iterator[Identification]:
        return (self[record] for record in range(self.inertia.shape[0] if self.inertia.ndim > 1 else 1))

    def __getitem__(self, place: RecordIndex | tuple[RecordIndex, ...]) -> Identification:
        batch = self.inertia.shape[:-1]
        if not batch:
            raise TypeError("only a result of several records can be indexed; this has one; use result.between(t0, t1)")
        place = in_batch(place, batch)
        records = chosen(place, batch)
        found = of_records(self._found, place)
        alone = found.status.ndim == 1
        words = self._told
        each = [words.each[record] for record in records] if words.each else []
        jumps = tuple(self.jumps[record] for record in records)
        one = Identification(
            found,
            time=self.time,
            terms=list(self.terms),
            jumps=jumps[0] if alone else jumps,
            words=words if not each else each[0] if alone else of_batch(each),
            settings=settings_of(self.settings, records, found.kinds, alone=alone),
            recorded=None if self._recorded is None else self._recorded.of(place),
        )
        if self._explained_each is not None:
            one._explained_each = [self._explained_each[record] for record in records]
        if self._whole is not None or (self._recorded is None and "_distrusted" in self.__dict__):
            # What is judged by the whole is not recorded in a part of it.
            one._distrusted = tuple(self._distrusted[record] if record < RECORDS else None for record in records)
        return one
