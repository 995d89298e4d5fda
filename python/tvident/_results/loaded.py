"""Results from files."""

from __future__ import annotations

from pathlib import Path

from tvident._results.result import Identification
from tvident._results.stored import restored, words_of


def load(path: str | Path) -> Identification:
    r"""Return a result that :meth:`Identification.save` wrote, as it was to the last bit.

    Parameters
    ----------
    path : str or Path
        A file that ends in ``.npz`` or ``.parquet``; one sample has one row there.

    Returns
    -------
    Identification
        Arrays of shape (\*, n) as they were saved. Without the recording:
        :meth:`Identification.simulate` needs ``initial=`` or ``angle=``, :meth:`Identification.vaf` both channels.

    Raises
    ------
    recordings.FileError
        If the file is not there, damaged, or holds no result.
    ImportError
        If pyarrow is missing for Parquet.

    See Also
    --------
    Identification.save : writes it.
    recordings.read : reads the columns of any file.

    Examples
    --------
    >>> import tvident
    >>> rig = tvident.simulate_torsional_rig(duration=3.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate)
    >>> result.save("result.npz")
    >>> bool((tvident.load("result.npz").stiffness == result.stiffness).all())
    True
    """
    found, facts, time = restored(path)
    several = found.status.ndim > 1
    return Identification(
        found,
        time=time,
        terms=list(facts["terms"]),
        jumps=tuple(tuple(one) for one in facts["jumps"]) if several else tuple(facts["jumps"]),
        words=words_of(facts["words"]),
        settings=facts["settings"],
    )
