"""Results from files, as they were to the last bit: those of trials and masses, and those of one record."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from tvident import _arguments as arguments
from tvident._files import FileError, printable, read_result
from tvident._merged.elements import Element
from tvident._merged.held_back import HeldBackTorque
from tvident._merged.merging import Identifiable, Merging
from tvident._merged.result import MergedIdentification
from tvident._merged.sampling import Sampling
from tvident._merged.stored import FORMAT, KIND, OWN, entries_of
from tvident._results import KIND_OF_LISTS, curves_from, from_file, list_from_file, scan_from, words_from
from tvident._status import Status

Array: TypeAlias = npt.NDArray[np.float64]


@arguments.called_as("load('result.csv')")
def load(path: str | Path) -> Any:
    r"""Return a result that ``save`` wrote, as it was to the last bit.

    Parameters
    ----------
    path : str or Path
        A file that ends in ``.npz`` or ``.parquet``; one sample has one row there.

    Returns
    -------
    Identification, IdentifiedRecords or MergedIdentification
        What was saved; types say Any, since only the file knows. Arrays of shape (\*, n) as they were saved. Without the recording:
        :meth:`Identification.simulate` needs ``initial=`` or ``angle=``, :meth:`Identification.vaf` both channels.

    Raises
    ------
    recordings.FileError
        If the file is not there, damaged, or holds no result.
    ImportError
        If pyarrow is missing for Parquet.

    See Also
    --------
    Identification.save, IdentifiedRecords.save, MergedIdentification.save : write it.
    recordings.read : reads the columns of any file.

    References
    ----------
    NumPy: NEP 1, A simple file format for NumPy arrays: NPZ. Apache Parquet: its format specification.

    Examples
    --------
    >>> import tvident
    >>> rig = tvident.simulate_torsional_rig(duration=3.0)
    >>> result = tvident.identify(rig.angle, rig.torque, sample_rate=rig.sample_rate)
    >>> result.save("result.npz")
    >>> bool((tvident.load("result.npz").stiffness == result.stiffness).all())
    True
    """
    arrays, text = read_result(arguments.path_of("path", path))
    place = printable(path)
    try:
        facts = json.loads(text)
        if facts.get("kind") == KIND_OF_LISTS:
            return list_from_file(place, arrays, facts)
        if facts.get("kind") != KIND:
            return from_file(place, arrays, facts)
        if facts["format"] == FORMAT:
            return _restored(arrays, facts)
    except FileError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError) as error:
        cure = "read it with tvident.read_recording if identify_file wrote it, or save it again"
        raise FileError(
            f"{place}: must hold a result as result.save writes it; it lacks {printable(error, 60)}; {cure}"
        ) from None
    raise FileError(f"{place}: holds a result of another version; identify again with the version at hand")


def _restored(arrays: Mapping[str, Any], facts: Mapping[str, Any]) -> MergedIdentification:
    """Return the result that a file holds."""
    plain = facts["merging"]
    elements = [
        Element(one["name"], one["of"], tuple(map(tuple, one["entries"])), one["value"]) for one in facts["elements"]
    ]
    masses, size = plain["masses"], arrays["time"].size
    inertia = {}
    for name in facts["inertia"]:
        pattern = np.zeros((masses, masses, size))
        for (row, column), values in entries_of(pattern):
            values[:] = arrays[f"{name} in the inertia {row} {column}"]
        inertia[name] = pattern
    merging = Merging(
        elements,
        (),
        sampling=Sampling(*facts["sampling"]),
        phase=arrays.get("phase"),
        units=facts["units"],
        # Patterns are those of the samples that were wanted.
        inertia=inertia,
        **plain,
    )
    names = [element.name for element in elements]
    covariances: dict[tuple[str, str], Array] = {}
    for number, (one, other, value) in enumerate(facts["between"], 1):
        if value == OWN:
            covariances[one, other] = arrays[f"{one}_stderr"] ** 2
        else:
            covariances[one, other] = arrays[f"covariance {number}"] if value is None else np.broadcast_to(value, size)
    # Files of before do not say what of the recording is explained.
    compared = (
        {"_held_back": _held_back_from(facts["held_back"]), "_share": facts["explained"]}
        if "held_back" in facts
        else {}
    )
    compared |= {"_distrusted": facts["distrusted"]} if "distrusted" in facts else {}
    return MergedIdentification.of_known(
        merging,
        {
            **compared,
            "time": arrays["time"],
            "phase": arrays.get("phase"),
            "elements": {name: arrays[name] for name in names},
            "stderr": {name: arrays[f"{name}_stderr"] for name in names},
            "residual_std": arrays["residual_std"],
            "status": arrays["status"],
            "record_status": Status(facts["record_status"]),
            "kinds": facts["kinds"],
            "constants": {name: (pair[0], pair[1]) for name, pair in facts["constants"].items()},
            # Files of before have none.
            "expansions": curves_from(facts.get("expansions", {})),
            "tests": facts["tests"],
            "jumps": tuple(facts["jumps"]),
            "trial_spread": {
                name: (np.array(one), np.array(two)) for name, (one, two) in facts["trial_spread"].items()
            },
            "identifiable": {name: Identifiable(**one) for name, one in facts["identifiable"].items()},
            "settings": facts["settings"],
            "scans": tuple(scan_from(scan) for scan in facts["scans"]),
            "_told": words_from(facts["words"]),
            "_covariances": covariances,
        },
    )


def _held_back_from(plain: Mapping[str, Any]) -> HeldBackTorque:
    """Return what a file says of parts that were held back."""
    shares = {name: np.asarray(plain[name], np.float64) for name in ("predicted", "simulated")}
    return HeldBackTorque(**shares, parts=plain["parts"], why_not=plain["why_not"])
