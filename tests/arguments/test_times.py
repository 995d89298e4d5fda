"""Times as recorders give them: with few digits, as dates, in time zones; what they cannot tell is said with what to type."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tvident
from tvident._arguments import sample_period

COUNT = np.arange(3000)


def rate(t: Any) -> float:
    return 1 / sample_period(len(t), t=t)


@pytest.mark.parametrize("cut", [np.round, lambda t, digits: np.floor(t * 10**digits + 1e-6) / 10**digits])
@pytest.mark.parametrize(("of", "digits"), [(512, 3), (610.35, 4), (44100, 5), (1000, 3), (240, 3), (1000 / 3, 3)])
def test_few_digits_give_the_rate_that_was_set(of: float, digits: int, cut: Any) -> None:
    for start in (0.0, 12.3456, 1.7e9):
        t = cut(start + COUNT / of, digits)
        # A rate of few digits is found again, any other to what the digits tell over the record.
        expected = pytest.approx(of, rel=1e-7 if of != 1000 / 3 else 10.0**-digits / (COUNT.size / of))
        assert rate(t) == expected
    assert rate((cut(COUNT / of, digits)).astype(np.float32)) == pytest.approx(of, rel=1e-4)


def printed(t: Any, significant: int) -> Any:
    return np.array([float(f"{one:.{significant}g}") for one in t])


@pytest.mark.parametrize(("of", "digits", "count"), [(1024, 6, 15000), (512, 6, 7000), (333, 6, 9000)])
def test_so_many_digits_from_the_first_on_are_few_at_the_end(of: int, digits: int, count: int) -> None:
    """Times as ``%.6g`` prints them were taken for stamps that jitter: their first have more digits behind the point."""
    t = np.arange(count) / of
    assert rate(printed(t, digits)) == pytest.approx(of, rel=1e-7)
    moved = t + np.random.default_rng(1).uniform(-0.2, 0.2, count) / of
    for other in (moved, np.r_[t[:4000], t[4000:] + 1 / of]):
        with pytest.raises(ValueError, match="t must be uniform"):
            rate(printed(np.sort(np.abs(other)), digits))


@given(of=st.integers(50, 900), digits=st.just(3), lost=st.integers(300, 2700))
def test_a_lost_sample_is_never_taken_for_rounding(of: int, digits: int, lost: int) -> None:
    t = np.round(np.where(lost > COUNT, COUNT, COUNT + 1) / of, digits)
    with pytest.raises(ValueError, match="t must be uniform"):
        rate(t)


@pytest.mark.parametrize(
    ("t", "message"),
    [
        (np.round(COUNT / 512, 2), "t must tell samples apart; .* give sample_rate=512 instead of t"),
        (COUNT // (COUNT.size // 2), r"t must increase; t\[1\] = 0.0 is that of the sample before"),
        (COUNT.size // 2 < COUNT, r"t must increase; t\[1\] = 0.0 is that of the sample before"),
        (np.round(COUNT[:20] / 512, 3), "t must tell the sample rate to a thousandth; .* give sample_rate=5"),
        (COUNT / 512 + 1e-4 * np.sin(COUNT / 10), "t must be uniform; .* or give sample_rate=512 if only the clock"),
        (np.r_[COUNT, 5000], "t must be uniform; the step to .* resample the record onto a uniform grid$"),
        (COUNT.astype("M8[M]"), "t must have a unit of fixed length"),
        (np.array(["2024-01-01", "NaT", "2024-01-03"], "M8[D]"), r"t\[1\] is missing"),
    ],
)
def test_times_that_do_not_tell_say_what_to_give(t: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        rate(t)


def test_text_is_refused_with_how_to_read_it() -> None:
    with pytest.raises(TypeError, match=r"t must hold numbers; got text; read it with .*, dates with .*datetime64"):
        rate(["2024-01-01", "2024-01-02"])


def test_dates_of_every_kind() -> None:
    pd, pl = pytest.importorskip("pandas"), pytest.importorskip("polars")
    begin = dt.datetime(2024, 10, 27, 0, 59, 59, tzinfo=dt.UTC)  # a second before summer time ends
    milliseconds = [dt.timedelta(milliseconds=int(one)) for one in COUNT]
    dates = [begin + one for one in milliseconds]
    index = pd.DatetimeIndex(dates).tz_convert("Europe/Paris")
    plain = np.array([one.replace(tzinfo=None) for one in dates], "M8[us]")
    for t in (dates, milliseconds, index, pd.Series(index), pd.TimedeltaIndex(milliseconds), list(index)):
        assert rate(t) == pytest.approx(1000, rel=1e-12)
    for t in (
        plain,
        plain[:, np.newaxis],
        plain - plain[0],
        pl.Series(plain),
        pl.Series(plain).dt.replace_time_zone("UTC"),
    ):
        assert rate(t) == pytest.approx(1000, rel=1e-12)
    # 512 Hz kept in whole milliseconds, and what a result makes of dates: seconds from the first sample on.
    rounded = plain[0].astype("M8[ms]") + np.round(COUNT * 1000 / 512).astype("m8[ms]")
    assert rate(rounded) == 512
    signal = np.sin(COUNT / 30)
    result = tvident.identify(signal, signal, t=rounded, damping=0, inertia=0)
    assert result.time[0] == 0
    assert result.time[512] == 1


def test_a_unit_of_time_beside_a_rate_in_hz_is_refused() -> None:
    """One sample in a ms was taken for one in a second: the inertia was a million times too large."""
    rig = tvident.simulate_torsional_rig(duration=2, sample_rate=1000)
    with pytest.raises(
        TypeError,
        match=r"time_unit= is the unit of t= and delta=; got 'ms' beside sample_rate=, which is in Hz; leave it out, or give delta=",
    ):
        tvident.identify(rig.angle, rig.torque, sample_rate=1, time_unit="ms")


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "ms"), (1e6, "us"), (1e9, "ns")])
@pytest.mark.parametrize("scatter", [0.0, 0.2])
def test_counts_since_1970_are_no_seconds(factor: float, unit: str, scatter: float) -> None:
    """Stamps in ms gave an inertia of 12 315 kg m² at 1 Hz, with a question; derivatives of those that scatter had none."""
    rig = tvident.simulate_torsional_rig(duration=2.0)
    late = scatter * np.random.default_rng(0).uniform(size=rig.time.size)
    stamps = np.round(factor * (1_700_000_000 + rig.time + late / 1000))
    calls: list[Callable[[], object]] = [
        lambda: tvident.identify(rig.angle, rig.torque, t=stamps),
        lambda: tvident.fit_local_polynomials(rig.angle, 51, t=stamps),
        lambda: tvident.rolling_least_squares(rig.angle[:, None], rig.torque, "0.2 s", t=stamps),
    ]
    for call in calls:
        with pytest.raises(ValueError, match=rf"would be of the year .* 'time \[{unit}\]', .*time_unit='{unit}'"):
            call()
    result = tvident.identify(rig.angle, rig.torque, t=stamps, time_unit=unit)
    assert result.value("inertia").value == pytest.approx(0.0123, rel=0.02)
    # Seconds since 1970, or from any zero, are seconds, and so are those of a record of many years.
    for times in (1_700_000_000 + rig.time, 1e9 * np.arange(rig.time.size), 1e11 * (1 + np.arange(rig.time.size))):
        tvident.fit_local_polynomials(rig.angle, 51, t=times)
