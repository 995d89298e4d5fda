"""A parameter as a curve over what it is a function of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._expansion import Basis, Rivals, variance_of_steps

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array: TypeAlias = npt.NDArray[np.float64]

_POINTS = 201


@dataclass(frozen=True)
class ExpandedParameter:
    r"""A parameter that was identified as a sum of functions: ``result.expansions["stiffness"]``.

    Attributes
    ----------
    name : str
    family : str
        Of the functions.
    size : int or (int, int)
        How many there are.
    coefficients : ndarray, shape (m,)
        Their factors, of the size that was taken; of ``"powers"`` those of the powers of x from -1 to 1 over the limits, of two channels
        all products, the second running faster.
    covariance : ndarray, shape (m, m)
        Of the factors.
    limits : (float, float), or a pair of them
        The range that the functions live on.
    position : ndarray, shape (201,), or a pair of them
        Even places within the limits: what the parameter is a function of.
    value, stderr : ndarray, shape (201,) or (201, 201)
        The curve there, and its standard error: K(position) with its band. It contains by how much curves of other sizes that explain
        the record nearly as well differ. Of time, where the record chooses the size, the curve is the mean over all sizes with the weights
        of the table; otherwise it is that of ``coefficients``.
    sizes : dict of str to ndarray
        Every size that was tried: ``"size"``, ``"criterion"`` (corrected Akaike; the smallest size was taken whose criterion is at most 4
        above the lowest), ``"residual"`` (mean square of the equations' residuals over their noise: 1 where noise explains them),
        ``"parameters"`` of the whole equation, and ``"weight"``: exp(-(criterion + parameters)/4), of sum one.
    unit, unit_of : str
        Units of the parameter, and of what it is a function of.

    See Also
    --------
    Expansion : asks for it.
    figures.plot_expansion : draws it.

    References
    ----------
    C. M. Hurvich, C.-L. Tsai: Regression and time series model selection in small samples, Biometrika 76 (1989): the criterion.
    G. Leung, A. R. Barron: Information theory and mixing least-squares regressions, IEEE Transactions on Information Theory 52 (2006): the
    weights.

    Examples
    --------
    >>> import tvident
    >>> rig = tvident.simulate_torsional_rig(duration=8.0)
    >>> spring = tvident.Expansion("bspline", of=rig.slider_position)
    >>> result = tvident.identify(
    ...     rig.angle, rig.torque, sample_rate=1000, inertia="constant", damping="constant", stiffness=spring
    ... )
    >>> curve = result.expansions["stiffness"]
    >>> curve.value.shape, len(curve.coefficients) == curve.size
    ((201,), True)
    >>> good = curve.sizes["criterion"] <= curve.sizes["criterion"].min() + 4
    >>> bool(curve.sizes["size"][good].min() == curve.size)
    True
    """

    name: str
    family: str
    coefficients: Array
    covariance: Array
    sizes: Mapping[str, npt.NDArray[Any]]
    limits: Any
    unit: str = ""
    unit_of: str = "s"
    _basis: Basis | None = field(default=None, repr=False)
    _own: Array = field(default_factory=lambda: np.zeros(0), repr=False)
    _own_root: Array = field(default_factory=lambda: np.zeros((0, 0)), repr=False)
    _rivals: Rivals = field(default=Rivals(), repr=False)

    @property
    def size(self) -> Any:
        """How many functions there are: an int, or one for each of two channels.

        See Also
        --------
        sizes : what was tried.
        Expansion : asks for a size.
        """
        sizes = self._functions.sizes
        return int(sizes[0]) if len(sizes) == 1 else tuple(int(one) for one in sizes)

    @property
    def position(self) -> Any:
        """Even places within the limits, shape (201,), or one such array for each of two channels, in the channel's unit.

        See Also
        --------
        value, stderr : the curve there.
        at : the curve at other places.
        """
        each = tuple(np.linspace(low, high, _POINTS) for low, high in self._ranges)
        return each[0] if len(each) == 1 else each

    @property
    def value(self) -> Array:
        """The curve at ``position``, shape (201,), or the surface over both, (201, 201), in the parameter's unit.

        See Also
        --------
        stderr : its error.
        at : at other places.

        References
        ----------
        The expansion is explained in docs/expansions.md.
        """
        return self.at(*self._grid)

    @property
    def stderr(self) -> Array:
        """Its standard error, in the shape and unit of ``value``.

        See Also
        --------
        value : the curve.
        stderr_at : at other places.

        References
        ----------
        By the delta method, from the covariance of all factors: docs/expansions.md.
        """
        return self.stderr_at(*self._grid)

    def at(self, *positions: npt.ArrayLike) -> Array:
        """Return the curve at places within the limits; NaN outside of them.

        Parameters
        ----------
        *positions : array_like
            One for each channel, of the same shape.

        Returns
        -------
        ndarray of float64, of that shape

        See Also
        --------
        stderr_at : errors there.
        value : at even places.

        References
        ----------
        The expansion is explained in docs/expansions.md.
        """
        functions, inside, shape = self._at(positions)
        moved, _ = self._beside(positions)
        return np.where(inside, functions @ self._own + moved, np.nan).reshape(shape)

    def stderr_at(self, *positions: npt.ArrayLike) -> Array:
        """Return standard errors of the curve at places within the limits; NaN outside of them.

        Parameters
        ----------
        *positions : array_like
            One for each channel, of the same shape.

        Returns
        -------
        ndarray of float64, of that shape

        See Also
        --------
        at : the curve there.
        stderr : at even places.

        References
        ----------
        By the delta method, from the covariance of all factors: docs/expansions.md.
        """
        functions, inside, shape = self._at(positions)
        variance = ((functions @ self._own_root) ** 2).sum(axis=1)
        _, added = self._beside(positions)
        added = added + variance_of_steps(self._functions, self._own, self._own_root, self._places(positions))
        variance = np.maximum(variance, 0) + added
        return np.where(inside, np.sqrt(np.maximum(variance, 0)), np.nan).reshape(shape)

    def plot(self, *, truth: Any = None, ax: Axes | Sequence[Axes] | None = None) -> Figure:
        """Draw the curve with a band of two standard errors, and the criterion of every size.

        Parameters
        ----------
        truth : callable, optional
            The true curve, as a function of the position.
        ax : Axes or sequence of Axes, optional
            Where to draw.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        ImportError
            If matplotlib is missing: install ``tvident[plot]``.
        ValueError
            If it is a function of two channels.

        See Also
        --------
        at, stderr_at : the numbers.
        tvident.figures : other pictures.
        """
        from tvident import _figures  # noqa: PLC0415 - matplotlib is optional

        return _figures.plot_expansion(self, truth=truth, ax=ax)

    @property
    def _functions(self) -> Basis:
        if self._basis is None:
            raise ValueError("the functions of this expansion are not at hand")
        return self._basis

    @property
    def _ranges(self) -> list[tuple[float, float]]:
        return [one.limits for one in self._functions.coordinates]

    @property
    def _grid(self) -> tuple[Array, ...]:
        position = self.position
        return (position,) if isinstance(position, np.ndarray) else tuple(np.meshgrid(*position, indexing="ij"))

    def _at(self, positions: Sequence[npt.ArrayLike]) -> tuple[Array, npt.NDArray[np.bool_], tuple[int, ...]]:
        ranges = self._ranges
        if len(positions) != len(ranges):
            raise ValueError(
                f"{self.name} is a function of {len(ranges)} channels; got {len(positions)}; give one position for each"
            )
        shape = np.broadcast_shapes(*(np.shape(one) for one in positions))
        places = self._unclipped(positions)
        inside = np.all([(place >= 0) & (place <= 1) for place in places], axis=0)
        return self._functions.at(self._places(positions)), inside, shape

    def _beside(self, positions: Sequence[npt.ArrayLike]) -> tuple[Array | float, Array | float]:
        """Return what other sizes add to the curve that was taken, and to its variance."""
        places = self._places(positions)
        return self._rivals.beside(lambda basis: basis.at(places))

    def _unclipped(self, positions: Sequence[npt.ArrayLike]) -> list[Array]:
        """Return positions as parts of the range of each channel."""
        arrays = np.broadcast_arrays(*(np.asarray(one, dtype=np.float64) for one in positions))
        return [(one.ravel() - low) / (high - low) for one, (low, high) in zip(arrays, self._ranges, strict=True)]

    def _places(self, positions: Sequence[npt.ArrayLike]) -> list[Array]:
        """Return the same where they are within the range, zero elsewhere."""
        places = self._unclipped(positions)
        inside = np.all([(place >= 0) & (place <= 1) for place in places], axis=0)
        return [np.where(inside, place, 0.0) for place in places]


def of_powers(coefficients: Array, covariance: Array) -> tuple[Array, Array]:
    """Return the factors of powers that those of Legendre polynomials stand for, and their covariance."""
    change = np.zeros((coefficients.size, coefficients.size))
    for degree in range(coefficients.size):
        change[: degree + 1, degree] = np.polynomial.legendre.leg2poly(np.eye(coefficients.size)[degree, : degree + 1])
    return change @ coefficients, change @ covariance @ change.T
