"""Random arrays: of any shape, with values that break arithmetic, of any type, laid out in any way."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

LENGTHS = (1, 2, 3, 5, 8, 9, 17, 63, 64, 65, 100, 127, 128, 129, 200, 201, 202, 300, 401, 800, 1000, 1500, 2047, 2500)
"""Of records: around the lengths of vectors and windows."""

BAD = (np.nan, np.inf, -np.inf, 1e308, 5e-324, -0.0, 0.0, 1e141)
"""Values that stand in the midst of others."""


def shape(generator: np.random.Generator) -> tuple[int, ...]:
    """Give a shape: mostly of one record, sometimes of a batch, of one number or of nothing."""
    axes = int(generator.choice([0, 1, 1, 1, 1, 1, 1, 1, 2, 2, 3, 4]))
    if not axes:
        return ()
    samples = 0 if generator.random() < 0.02 else int(generator.choice(LENGTHS))
    return (
        *(int(generator.choice([0, 1, 1, 2, 2, 3])) for _ in range(axes - 1)),
        min(samples, 2500 if axes == 1 else 600),
    )


def values(generator: np.random.Generator, of_shape: tuple[int, ...]) -> Array:
    """Give samples of some character."""
    n = int(np.prod(of_shape))
    t = np.arange(n) / 100
    noise = generator.standard_normal(n)
    waves = np.sin(7 * t) + np.sin(31 * t)
    characters = (
        lambda: noise,
        lambda: waves + 1e-3 * noise * generator.choice([0, 1, 100]),
        lambda: waves + 1e-3 * noise,
        lambda: np.cumsum(noise),
        lambda: np.full(n, generator.choice([0.0, 1.0, -3.7, 1e60, 5e-324, 1e-310])),
        lambda: noise * generator.choice([1e-9, 1.0, 1e-3]) + generator.choice([1e6, 1e12, 1e16, -1e60]),
        lambda: np.round(noise),
        lambda: noise * generator.choice([1e20, 1e40, 1e60]),
        lambda: noise * generator.choice([1e-20, 1e-40, 1e-60]),
        lambda: np.round(50 * waves) / 50,
        lambda: noise * (generator.random(n) < 0.02),
    )
    found = np.array(characters[int(generator.integers(len(characters)))](), dtype=np.float64)
    for _ in range(int(generator.choice([0, 0, 0, 1, 3])) if n else 0):
        first = int(generator.integers(n))
        found[first : first + int(generator.choice([1, 1, 5, 50, n]))] = generator.choice(BAD)
    return found.reshape(of_shape)


_KINDS = ("f2", "f4", "g", "i1", "i2", "i4", "i8", "u1", "u8", "?", ">f8", ">f4", ">i2")
_NO_NUMBERS = ("O", "c16", "S8", "U5", "M8[s]", "m8[s]", "fields", "None", "text", "number", "ragged")


def dressed(generator: np.random.Generator, samples: Array) -> tuple[Any, str]:
    """Give samples in another type or layout, or something else that a careless user may pass; and a word for it."""
    drawn = generator.random()
    if drawn < 0.5:
        kind = "f8"
    elif drawn < 0.8:
        kind = str(generator.choice(_KINDS))
    elif drawn < 0.9:
        kind = str(generator.choice(["masked", "list", "field"]))
    else:
        kind = str(generator.choice(_NO_NUMBERS))
    with np.errstate(all="ignore"):
        array = _of_kind(generator, samples, kind)
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "biuf" or kind == "masked" or not array.ndim:
        return array, kind
    layouts = (
        "plain",
        "plain",
        "fortran",
        "reversed",
        "every third",
        "backwards",
        "repeated",
        "unaligned",
        "fixed",
        "subclass",
    )
    layout = str(generator.choice(layouts))
    return _laid_out(array, layout), f"{kind} {layout}"


def _of_kind(generator: np.random.Generator, samples: Array, kind: str) -> Any:  # noqa: PLR0911 - one a kind
    whole = np.clip(np.nan_to_num(samples), -100, 100).astype(np.int64)
    match kind:
        case "masked":
            some = np.float64 if generator.random() < 0.5 else np.int16
            return np.ma.masked_array(
                (samples if some is np.float64 else whole).astype(some), mask=generator.random(samples.shape) < 0.1
            )
        case "list":
            return samples.tolist()
        case "field" | "fields":
            both = np.zeros(samples.shape, dtype=[("x", "i1"), ("y", "f8")])
            both["y"] = samples
            return both["y"] if kind == "field" else both
        case "None":
            return None
        case "text":
            return "abc"
        case "number":
            return 1.0
        case "ragged":
            return [[1.0, 2.0], [3.0]]
        case "M8[s]" | "m8[s]":
            return whole.astype(kind)
        case _:
            return (whole if np.dtype(kind).kind in "iu" else samples).astype(kind)


def _laid_out(array: Array, layout: str) -> Array:  # noqa: PLR0911 - one a layout
    match layout:
        case "fortran":
            return np.asfortranarray(array)
        case "reversed":
            return array[..., ::-1].copy()[..., ::-1]
        case "every third" | "backwards":
            step = 3 if layout == "every third" else -2
            wide = np.zeros((*array.shape[:-1], array.shape[-1] * abs(step)), array.dtype)
            wide[..., ::step] = array
            return wide[..., ::step]
        case "repeated" if array.size:
            return np.broadcast_to(array.ravel()[0], array.shape)
        case "unaligned":
            raw = np.zeros(array.nbytes + 1, np.uint8)
            shifted = raw[1:].view(array.dtype).reshape(array.shape)
            shifted[...] = array
            return shifted
        case "fixed":
            fixed = array.copy()
            fixed.flags.writeable = False
            return fixed
        case "subclass":
            return array.view(_Subclass)
        case _:
            return array


class _Subclass(np.ndarray[Any, Any]):
    """An array of another class."""


def plain(array: Any) -> Array | None:
    """Give the same numbers as a plain array of doubles, where there is one."""
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "biuf":
        return None
    if isinstance(array, np.ma.MaskedArray):
        return np.asarray(np.ma.filled(array.astype(np.float64), np.nan))
    with np.errstate(all="ignore"):
        return np.array(array, dtype=np.float64, subok=False)
