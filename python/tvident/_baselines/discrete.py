"""TVARX: the angle as a combination of its past and the torque's, with factors that are polynomials of time in moving windows."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._baselines.recursive import Tracked

Array: TypeAlias = npt.NDArray[np.float64]


@np.errstate(all="ignore")  # what leaves the range of doubles is not known
def tvarx(
    angle: npt.ArrayLike, torque: npt.ArrayLike, window: int, *, delta: float, degree: int = 1, every: int = 1
) -> Tracked:
    """Return inertia, damping and stiffness from θ_k = a₁ θ_{k-1} + a₂ θ_{k-2} + b₀ T_k + b₁ T_{k-1} + b₂ T_{k-2} + c.

    The static gain is one over the stiffness; the poles, as continuous ones, give damping and inertia.

    Parameters
    ----------
    angle, torque : array_like, shape (n,)
    window : int
        Samples: by hand.
    delta : float
        Seconds between samples.
    degree : int, optional
        Of the polynomials of time within a window.
    every : int, optional
        Samples are averaged in groups of so many, since poles of a fast record are next to one.

    Returns
    -------
    Tracked
        Values of shape (n, 3); NaN where poles are none of an oscillator. Errors are not known: NaN.

    Raises
    ------
    ValueError
        If the window is too short or longer than the record.

    See Also
    --------
    expanded_least_squares : functions of time over the whole record, with derivatives.
    tvident.identify : the equation of motion as it is, without poles.

    References
    ----------
    L. Ljung: System Identification: Theory for the User, 2nd edition, Prentice Hall 1999: the model with constant factors, ARX.
    Y. Li, H. L. Wei, S. A. Billings: Identification of time-varying systems using multi-wavelet basis functions, IEEE Transactions on
    Control Systems Technology 19 (2011): TVARX, whose factors are sums of functions of time.

    Examples
    --------
    >>> import tvident
    >>> from tvident.baselines import tvarx
    >>> rig = tvident.simulate_torsional_rig(duration=6.0, pattern="constant", torque_snr_db=100, angle_noise=1e-7)
    >>> found = tvarx(rig.angle, rig.torque, 2000, delta=1e-3, degree=0, every=4)
    >>> bool(abs(found.values[3000, 2] / rig.stiffness[0] - 1) < 1e-3)
    True
    """
    every = arguments.whole_number("every", every, least=1)
    window = arguments.whole_number("window", window, least=1)
    period = arguments.positive_number("delta", delta) * every
    both = [np.asarray(one, np.float64) for one in arguments.channels(angle=angle, torque=torque)]
    if both[0].ndim != 1:
        raise ValueError(f"angle and torque must be one record; got shape {both[0].shape}; take one of them")
    samples = both[0].size
    count = samples // every
    place, force = (one[: count * every].reshape(count, every).mean(axis=1) for one in both)
    rows = max(1, window // every)
    terms = 6 * (arguments.whole_number("degree", degree, least=0) + 1)
    if not terms < rows <= count:
        raise ValueError(
            f"a window must hold more groups than the {terms} factors, and fit into {count}; got {rows}; change window= or every="
        )
    past = np.stack([place[1:-1], place[:-2], force[2:], force[1:-1], force[:-2], np.ones(count - 2)], axis=1)
    scale = np.sqrt(np.mean(past**2, axis=0))
    past = past / np.where(scale > 0, scale, 1)
    target = place[2:]
    found = np.full((count, 3), np.nan)
    step = max(1, rows // 8)
    middles = np.arange(rows // 2, count - 2 - rows // 2, step)
    for middle in middles:
        some = slice(middle - rows // 2, middle - rows // 2 + rows)
        within = np.linspace(-1, 1, past[some].shape[0])
        design = np.concatenate([past[some] * within[:, np.newaxis] ** power for power in range(degree + 1)], axis=1)
        if not (np.isfinite(design).all() and np.isfinite(target[some]).all()):
            continue
        factor = np.linalg.lstsq(design, target[some], rcond=None)[0][:6] / np.where(scale > 0, scale, 1)
        found[middle + 2] = _continuous(factor, period)
    known = middles + 2
    if known.size:
        for column in range(3):
            there = known[np.isfinite(found[known, column])]
            if there.size:
                inside = np.arange(known[0], known[-1] + 1)
                found[inside, column] = np.interp(inside, there, found[there, column])
    values = np.full((samples, 3), np.nan)
    values[: count * every] = np.repeat(found, every, axis=0)
    return Tracked(values, np.full(values.shape, np.nan))


def _continuous(factor: Array, period: float) -> Array:
    """Return inertia, damping and stiffness of a discrete model."""
    first, second, *gains, _ = factor
    poles = np.roots([1, -first, -second]).astype(complex)
    if not np.all(abs(poles) > 0) or sum(gains) == 0:
        return np.full(3, np.nan)
    stiffness = (1 - first - second) / sum(gains)
    slow = np.log(poles) / period
    product, total = np.prod(slow), np.sum(slow)
    if abs(product.imag) > 1e-6 * abs(product) or product.real <= 0:
        return np.full(3, np.nan)
    inertia = stiffness / product.real
    return np.array([inertia, -inertia * total.real, stiffness])
