"""A torsional rig to try identification on: a beam with a disk at its end and a slider that shortens the beam."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from tvident import arguments, table

Array: TypeAlias = npt.NDArray[np.float64]
Pattern: TypeAlias = Literal["slider", "ramp", "square", "constant"]
Excitation: TypeAlias = Literal["multisine", "chirp", "random"]
Function: TypeAlias = Callable[[Array], npt.ArrayLike]

_LOWEST, _HIGHEST = 0.5, 12.0
"""Band of every excitation, Hz."""
_SPACING = 0.25
"""Distance of the multisine's frequencies, Hz: it repeats every 4 s."""
_AMPLITUDE = 0.05
"""Torque of each of the multisine's frequencies, N·m."""
_ANGLE_A_STEP = 0.01
"""Phase that the highest frequency may advance in one step of integration: keeps the angle good to 1e-10."""
_BLOCK = 20_000
"""Samples integrated at a time."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A simulated recording and its truth; all arrays have shape (n,).

    Attributes
    ----------
    time : ndarray
        Seconds.
    angle, torque : ndarray
        What was recorded, noise included: rad, N m.
    slider_position : ndarray
        Free length of the beam, m.
    inertia, damping, stiffness : ndarray
        The truth: kg m², N m s/rad, N m/rad.
    true_angle, true_velocity, true_acceleration, true_torque : ndarray
        What the rig did.
    sample_rate : float
        Samples per second.

    Examples
    --------
    >>> import tvident
    >>> rig = tvident.simulate_torsional_rig(duration=1.0, pattern="constant")
    >>> float(rig.stiffness[0].round(3)), float(rig.slider_position[0])
    (13.333, 0.45)
    """

    time: Array
    angle: Array
    torque: Array
    slider_position: Array
    inertia: Array
    damping: Array
    stiffness: Array
    true_angle: Array
    true_velocity: Array
    true_acceleration: Array
    true_torque: Array
    sample_rate: float

    def save(self, path: str | Path) -> None:
        """Write time, angle, torque, slider position and truth to a CSV or NPZ file, with units in the header.

        Parameters
        ----------
        path : str or Path
            A name that ends in ``.csv`` or ``.npz``. The file appears whole or not at all.

        Raises
        ------
        ValueError
            If the ending is another one.
        OSError
            If there is no such folder, or the file cannot be written.
        """
        names = ("time", "angle", "torque", "slider_position", "inertia", "damping", "stiffness")
        table.write(path, {name: getattr(self, name) for name in names}, UNITS)


UNITS = {
    "time": "s",
    "angle": "rad",
    "torque": "N m",
    "slider_position": "m",
    "inertia": "kg m^2",
    "damping": "N m s/rad",
    "stiffness": "N m/rad",
}
"""Units of a recording's columns."""


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
        Power of the torque over that of its noise, dB.
    angle_noise : float, optional
        Noise of the angle over its standard deviation.
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
        If a number is not positive, or a name is unknown.
    TypeError
        If a number is none, or a count or the seed is not whole.

    Notes
    -----
    Equation (1) of the paper is integrated by the Magnus expansion of fourth order, in steps so short that the angle is good to 1e-10.
    It costs some 5 µs a sample.

    Examples
    --------
    >>> import tvident
    >>> recording = tvident.simulate_torsional_rig(duration=2.0, pattern=lambda t: 0.4 + 0.1 * t)
    >>> recording.angle.shape
    (2000,)
    >>> float(recording.stiffness[1000])  # 6 N m² / 0.5 m
    12.0
    """
    for name, number in (
        ("duration", duration),
        ("sample_rate", sample_rate),
        ("torsional_rigidity", torsional_rigidity),
    ):
        arguments.positive_number(name, number)
    samples = round(duration * sample_rate)
    if samples < 1:
        raise ValueError(f"duration must hold at least one sample; got {duration} s at {sample_rate} Hz; lengthen it")
    generator = np.random.default_rng(arguments.whole_number("seed", seed, least=0))
    drive = _Drive(arguments.one_of("excitation", excitation, get_args(Excitation)), sample_rate, generator)
    length = pattern if callable(pattern) else _pattern(pattern, duration)
    inertia_of, damping_of = _function("inertia", inertia), _function("damping", damping)

    def coefficients(t: Array) -> tuple[Array, Array, Array]:
        i = inertia_of(t)
        stiffness = torsional_rigidity / np.broadcast_to(np.asarray(length(t), dtype=np.float64), t.shape)
        return stiffness / i, damping_of(t) / i, 1 / i

    time = np.arange(samples) / sample_rate
    angle, velocity = _integrate(samples, sample_rate, coefficients, drive)
    position = np.array(np.broadcast_to(np.asarray(length(time), dtype=np.float64), time.shape))
    torque = drive.at_samples(samples)
    truth = {"inertia": inertia_of(time), "damping": damping_of(time), "stiffness": torsional_rigidity / position}
    acceleration = (torque - truth["damping"] * velocity - truth["stiffness"] * angle) / truth["inertia"]
    recorded_torque = torque + generator.standard_normal(samples) * torque.std() * 10 ** (-torque_snr_db / 20)
    if encoder_counts is None:
        recorded_angle = angle + generator.standard_normal(samples) * angle_noise * angle.std()
    else:
        count = 2 * np.pi / arguments.whole_number("encoder_counts", encoder_counts, least=1)
        recorded_angle = np.round(angle / count) * count
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
        sample_rate=float(sample_rate),
    )


def _function(name: str, value: float | Function) -> Callable[[Array], Array]:
    """Return a function of time from a number or a function."""
    if callable(value):
        return lambda t: np.array(np.broadcast_to(np.asarray(value(t), dtype=np.float64), t.shape))
    number = float(value)
    if name == "inertia":
        arguments.positive_number(name, number)
    return lambda t: np.full(t.shape, number)


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


class _Drive:
    """The driving torque at any time."""

    def __init__(self, excitation: str, sample_rate: float, generator: np.random.Generator) -> None:
        self._sample_rate = sample_rate
        self._period = 0
        self._frequencies, self._phases, self._amplitudes = np.zeros(0), np.zeros(0), np.zeros(0)
        count = round((_HIGHEST - _LOWEST) / _SPACING) + 1
        if excitation == "multisine":
            self._frequencies = np.linspace(_LOWEST, _HIGHEST, count)
            self._phases = generator.uniform(0, 2 * np.pi, count)
            self._amplitudes = np.full(count, _AMPLITUDE)
            period = sample_rate / _SPACING
            self._period = round(period) if float(period).is_integer() else 0
        elif excitation == "random":
            lines = 200
            self._frequencies = generator.uniform(_LOWEST, _HIGHEST, lines)
            self._phases = generator.uniform(0, 2 * np.pi, lines)
            self._amplitudes = _AMPLITUDE * math.sqrt(count / lines) * generator.rayleigh(math.sqrt(0.5), lines)
        else:
            # As much power as the multisine.
            self._amplitudes = np.array([_AMPLITUDE * math.sqrt(count)])
        self._tables: dict[float, Array] = {}

    def __call__(self, first: int, count: int, offset: float) -> Array:
        """Return the torque at ``offset`` of a sample period after each of some samples."""
        if not self._period:
            return self._at((np.arange(first, first + count, dtype=np.float64) + offset) / self._sample_rate)
        if offset not in self._tables:
            self._tables[offset] = self._at((np.arange(self._period, dtype=np.float64) + offset) / self._sample_rate)
        return np.take(self._tables[offset], np.arange(first, first + count), mode="wrap")

    def at_samples(self, samples: int) -> Array:
        """Return the torque at the first samples."""
        parts = range(0, samples, _BLOCK)
        return np.concatenate([self(first, min(_BLOCK, samples - first), 0.0) for first in parts])

    def _at(self, t: Array) -> Array:
        if not self._frequencies.size:
            sweep = 10.0
            local = t % sweep
            swept = 2 * np.pi * (_LOWEST * local + (_HIGHEST - _LOWEST) / (2 * sweep) * local**2)
            return np.asarray(self._amplitudes[0] * np.sin(swept))
        torque = np.zeros(t.shape)
        for frequency, phase, amplitude in zip(self._frequencies, self._phases, self._amplitudes, strict=True):
            np.add(torque, amplitude * np.sin(2 * np.pi * frequency * t + phase), out=torque)
        return torque


def _integrate(
    samples: int, sample_rate: float, coefficients: Callable[[Array], tuple[Array, Array, Array]], drive: _Drive
) -> tuple[Array, Array]:
    """Return angle and velocity at every sample, from rest."""
    probe = np.arange(0, samples, max(1, samples // 1000), dtype=np.float64) / sample_rate
    fastest = max(2 * np.pi * _HIGHEST, math.sqrt(float(np.max(coefficients(probe)[0]))))
    steps = max(1, math.ceil(fastest / sample_rate / _ANGLE_A_STEP))
    h = 1 / (sample_rate * steps)
    angle, velocity = np.empty(samples), np.empty(samples)
    x, v = 0.0, 0.0
    for first in range(0, samples, _BLOCK):
        count = min(_BLOCK, samples - first)
        # The affine map of each sample period, composed of those of its steps.
        total: Any = (
            np.ones(count),
            np.zeros(count),
            np.zeros(count),
            np.ones(count),
            np.zeros(count),
            np.zeros(count),
        )
        for step in range(steps):
            nodes = [(step + 0.5 + sign * math.sqrt(3) / 6) / steps for sign in (-1, 1)]
            matrices = []
            for node in nodes:
                k, c, g = coefficients((np.arange(first, first + count, dtype=np.float64) + node) / sample_rate)
                matrices.append((k, c, g * drive(first, count, node)))
            total = _compose(_magnus(h, *matrices), total)
        angles, velocities = [], []
        for a, b, c, d, e, f in zip(*(part.tolist() for part in total), strict=True):
            angles.append(x)
            velocities.append(v)
            x, v = a * x + b * v + e, c * x + d * v + f
        angle[first : first + count], velocity[first : first + count] = angles, velocities
    return angle, velocity


def _magnus(h: float, one: tuple[Array, Array, Array], other: tuple[Array, Array, Array]) -> Any:
    """Return the affine map of one step of x' = v, v' = -k x - c v + g, given (k, c, g) at its two Gauss points.

    The Magnus expansion of fourth order: the exponential of h (M1 + M2)/2 - h² √3/12 (M1 M2 - M2 M1).
    """
    (k1, c1, g1), (k2, c2, g2) = one, other
    s = math.sqrt(3) / 12 * h * h
    a = -s * (k1 - k2)
    b = h - s * (c1 - c2)
    e = -s * (g2 - g1)
    c = -h / 2 * (k1 + k2) - s * (c1 * k2 - c2 * k1)
    d = -h / 2 * (c1 + c2) - s * (k2 - k1)
    f = h / 2 * (g1 + g2) - s * (c2 * g1 - c1 * g2)
    # P = Σ B^n / (n+1)!, so that exp(B) = 1 + B P and the inhomogeneous part is P (e, f).
    terms = 10
    pa, pb, pc, pd = (
        np.full_like(a, 1 / (terms + 1)),
        np.zeros_like(a),
        np.zeros_like(a),
        np.full_like(a, 1 / (terms + 1)),
    )
    for n in range(terms, 0, -1):
        pa, pb, pc, pd = (
            (1 + (a * pa + b * pc)) / n,
            (a * pb + b * pd) / n,
            (c * pa + d * pc) / n,
            (1 + (c * pb + d * pd)) / n,
        )
    return (
        1 + a * pa + b * pc,
        a * pb + b * pd,
        c * pa + d * pc,
        1 + c * pb + d * pd,
        pa * e + pb * f,
        pc * e + pd * f,
    )


def _compose(later: Any, earlier: Any) -> Any:
    """Return the affine map that does one after another."""
    a2, b2, c2, d2, e2, f2 = later
    a1, b1, c1, d1, e1, f1 = earlier
    return (
        a2 * a1 + b2 * c1,
        a2 * b1 + b2 * d1,
        c2 * a1 + d2 * c1,
        c2 * b1 + d2 * d1,
        a2 * e1 + b2 * f1 + e2,
        c2 * e1 + d2 * f1 + f2,
    )
