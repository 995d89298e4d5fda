"""Natural frequencies and damping ratios of a result of trials or masses."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from tvident._merged import modal
from tvident._merged.elements import matrix_of
from tvident._merged.merging import Merging

Array: TypeAlias = npt.NDArray[np.float64]


class Oscillating:
    """The part of a result that oscillates.

    Attributes
    ----------
    time, elements :
        Those of the result.
    """

    time: Array
    elements: dict[str, Array]
    _merging: Merging

    @cached_property
    def _covariances(self) -> Mapping[tuple[str, str], Array]:
        """Covariances of pairs of elements."""
        raise NotImplementedError

    @cached_property
    def modes(self) -> modal.Modes:
        """Natural frequencies, damping ratios and shapes over time, each mode followed by its pole and shape.

        Raises
        ------
        ValueError
            If the equations of a mechanism are not linear in its motion.

        Returns
        -------
        Modes
            Frequencies in Hz and damping ratios, shape (modes, n), shapes, (masses, modes, n), and standard errors.

        See Also
        --------
        natural_frequency, damping_ratio : two of its arrays.
        Chain : masses whose modes these are.

        References
        ----------
        D. J. Ewins: Modal testing, theory, practice and application (2000), on complex modes.
        """
        merging = self._merging
        if merging.inertia:
            raise ValueError(
                "modes are those of linear equations; got a Mechanism, whose inertia moves with it; describe its motion around a "
                "position by a Chain or by matrices"
            )
        masses = max(merging.masses, 1)
        patterns = [matrix_of(merging.elements, coefficient, masses) for coefficient in range(3)]
        names = [one.name for one in merging.elements if any(one.name in pattern for pattern in patterns)]
        nothing = np.zeros((masses, masses))
        elements = [
            modal.ModalElement(tuple(pattern.get(name, nothing) for pattern in patterns), self.elements[name])  # type: ignore[arg-type] # three of them
            for name in names
        ]
        times = modal.times_of(self.time.size)
        covariances = {pair: values[times] for pair, values in self._covariances.items()}
        return modal.modes_of(elements, modal.shared(names, covariances, times.size), times, self.time.size)

    @property
    def natural_frequency(self) -> Array:
        """Natural frequencies in Hz, shape (n,) for trials, (modes, n) for masses.

        See Also
        --------
        modes : with damping ratios, shapes and errors.
        damping_ratio : the other half of the pole.

        References
        ----------
        Equation (j) of docs/mathematics.md for one mass; poles of the matrices for several: docs/together.md.
        """
        found = self.modes.natural_frequency
        return found if self._merging.masses else found[0]

    @property
    def damping_ratio(self) -> Array:
        """Damping ratios, without unit, shape (n,) for trials, (modes, n) for masses.

        See Also
        --------
        modes : with frequencies, shapes and errors.
        natural_frequency : the other half of the pole.

        References
        ----------
        Equation (j) of docs/mathematics.md for one mass; poles of the matrices for several: docs/together.md.
        """
        found = self.modes.damping_ratio
        return found if self._merging.masses else found[0]
