"""A torsional rig to try identification on: a beam with a disk at its end and a slider that shortens the beam."""

from __future__ import annotations

from typing import TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._choices import Excitation, Pattern
from tvident._simulate.drive import Drive
from tvident._simulate.functions import Function, function_of_time
from tvident._simulate.motion import integrate
from tvident._simulate.recording import Recording

Array: TypeAlias = npt.NDArray[np.float64]
_LEAST_SNR, _MOST_NOISE = -200.0, 1e10
"""In decibels for the torque, as a ratio for the angle: noise of ten thousand million times the signal."""

_MOST_SAMPLES = 100_000_000
"""More than a day at 1 kHz."""


# All have a default, as users call it. What leaves the range of doubles is refused or next to zero.
@np.errstate(all="ignore")
def simulate_torsional_rig(
    duration: float = 20.0,
    sample_rate: float = 1000.0,
    seed: int = 0,
    pattern: Pattern | Function = "slider",
    excitation: Excitation = "multisine",
    *,
    torque_snr_db: float = 20.0,
    angle_noise: float = 1e-4,
    encoder_counts: int | None = None,
    inertia: float | Function = 0.0123,
    damping: float | Function = 0.00825,
    torsional_rigidity: float = 6.0,
) -> Recording:
    """Simulate the paper's rig: I θ̈ + C θ̇ + K(t) θ = T with K(t) = GJ/L(t), L the free length that a slider leaves.

    Parameters
    ----------
    duration : float, optional
        Seconds.
    sample_rate : float, optional
        Samples per second.
    seed : int, optional
        Of the phases and the noise: the same seed gives the same recording.
    pattern : {"slider", "ramp", "square", "constant"} or callable, optional
        How the slider moves: two sines, a ramp between two rests, a jump every 4 s, not at all; or a function of time in seconds that
        returns the free length in m.
    excitation : {"multisine", "chirp", "random"}, optional
        Torque between 0.5 and 12 Hz: 47 sines of random phase, a sweep every 10 s, or 200 sines of random frequency.
    torque_snr_db : float, optional
        Power of the torque over that of its noise, dB; -200 or more.
    angle_noise : float, optional
        Noise of the angle over its standard deviation, 0 or more.
    encoder_counts : int, optional
        Counts a turn: the angle is rounded to whole counts instead of getting noise.
    inertia : float or callable, optional
        kg m²; or a function of time.
    damping : float or callable, optional
        N m s/rad; or a function of time.
    torsional_rigidity : float, optional
        GJ in N m².

    Returns
    -------
    Recording
        ``time``, ``angle``, ``torque``, ``slider_position`` and the truth, each of shape (n,).

    Raises
    ------
    ValueError
        If a number is not positive, a name is unknown, a function returns values that are not finite and positive (zero damping is
        allowed) or of another shape than the times, or the simulation would take longer than about ten minutes.
    TypeError
        If a number is none, or a count or the seed is not whole.

    Notes
    -----
    Equation (1) of the paper is integrated by the Magnus expansion of fourth order, in steps so short that the angle is good to 1e-10.
    It costs some 5 µs a sample.

    See Also
    --------
    identify : finds the parameters again.
    tvident.figures.plot_recording : draws it.

    References
    ----------
    M. Ruzek, S. Chesné, D. Rémond: Identification of a time-varying mechanical system using the Akaike information criterion.
    S. Blanes, F. Casas, J. A. Oteo, J. Ros: The Magnus expansion and some of its applications, Physics Reports 470 (2009).

    Examples
    --------
    >>> import tvident
    >>> recording = tvident.simulate_torsional_rig(duration=2.0, pattern=lambda t: 0.4 + 0.1 * t)
    >>> recording.angle.shape
    (2000,)
    >>> float(recording.stiffness[1000])  # 6 N m² / 0.5 m
    12.0
    """
    duration = arguments.positive_number("duration", duration)
    sample_rate = arguments.positive_number("sample_rate", sample_rate)
    arguments.sample_period(1, sample_rate=sample_rate)
    torsional_rigidity = arguments.positive_number("torsional_rigidity", torsional_rigidity)
    torque_noise = 10 ** (-arguments.finite_number("torque_snr_db", torque_snr_db, least=_LEAST_SNR) / 20)
    angle_noise = arguments.finite_number("angle_noise", angle_noise, least=0, most=_MOST_NOISE)
    count = None if encoder_counts is None else arguments.whole_number("encoder_counts", encoder_counts, least=1)
    samples = _samples(duration, sample_rate)
    generator = np.random.default_rng(arguments.whole_number("seed", seed, least=0))
    drive = Drive(arguments.one_of("excitation", excitation, get_args(Excitation)), sample_rate, samples, generator)
    length_of = function_of_time("pattern", pattern if callable(pattern) else _pattern(pattern, duration))
    inertia_of = function_of_time("inertia", inertia)
    damping_of = function_of_time("damping", damping, zero=True)

    def coefficients(t: Array) -> tuple[Array, Array, Array]:
        i = inertia_of(t)
        return torsional_rigidity / length_of(t) / i, damping_of(t) / i, 1 / i

    time = np.arange(samples) / sample_rate
    angle, velocity = integrate(samples, sample_rate, coefficients, drive)
    position = length_of(time)
    torque = drive.at_samples(samples)
    truth = {"inertia": inertia_of(time), "damping": damping_of(time), "stiffness": torsional_rigidity / position}
    acceleration = (torque - truth["damping"] * velocity - truth["stiffness"] * angle) / truth["inertia"]
    recorded_torque = torque + generator.standard_normal(samples) * torque.std() * torque_noise
    if count is None:
        recorded_angle = angle + generator.standard_normal(samples) * angle_noise * angle.std()
    else:
        step = 2 * np.pi / count
        recorded_angle = np.round(angle / step) * step
    return Recording(
        time=time,
        angle=recorded_angle,
        torque=recorded_torque,
        slider_position=position,
        **truth,
        true_angle=angle,
        true_velocity=velocity,
        true_acceleration=acceleration,
        true_torque=torque,
        sample_rate=sample_rate,
    )


def _samples(duration: float, sample_rate: float) -> int:
    """Return how many samples there are, if any and not too many."""
    samples = duration * sample_rate
    if samples > _MOST_SAMPLES:
        raise ValueError(
            f"duration times sample_rate must be at most {_MOST_SAMPLES:g} samples; got {samples:g}; shorten the recording"
        )
    if round(samples) < 1:
        raise ValueError(f"duration must hold at least one sample; got {duration} s at {sample_rate} Hz; lengthen it")
    return round(samples)


def _pattern(name: str, duration: float) -> Function:
    """Return the free length over time of a pattern by name."""
    arguments.one_of("pattern", name, get_args(Pattern))

    def slider(t: Array) -> Array:
        return np.asarray(0.45 + 0.12 * np.sin(2 * np.pi * 0.15 * t) + 0.03 * np.sin(2 * np.pi * 0.4 * t + 1))

    def ramp(t: Array) -> Array:
        return np.interp(t, [0.35 * duration, 0.55 * duration], [0.33, 0.57])

    def square(t: Array) -> Array:
        return np.where(np.floor(t / 4) % 2 == 0, 0.6, 0.3)

    def constant(t: Array) -> Array:
        return np.full(t.shape, 0.45)

    return {"slider": slider, "ramp": ramp, "square": square, "constant": constant}[name]
