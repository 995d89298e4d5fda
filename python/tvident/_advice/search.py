"""What a search for inner parameters of terms found, in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tvident._equation import InnerParameter
from tvident._results import Words

_FEWEST_SAMPLES = 5.0
"""Of a turn, below which simulated Stribeck friction was off by up to four standard errors."""


@dataclass(frozen=True)
class FoundBySearch:
    """What a search found of an inner parameter.

    Parameters
    ----------
    parameter : InnerParameter
    value, error : float
    limits : (float, float)
        The range that was searched.
    needed : bool
        Whether the term is needed.
    factor : float
        Of the term; its median where it changes.
    tried : int
        Identifications; 0 where an earlier result tells the value.
    gain : float
        By how much the term lowers the criterion, its inner parameters counted.
    chance : float
        How likely noise makes the term as significant, at any value of the range; NaN where its factor changes.
    at_end : bool
        Whether the value is an end of the range.
    lasts : float
        Samples of a turn in which Stribeck friction fades.
    """

    parameter: InnerParameter
    value: float
    error: float
    limits: tuple[float, float]
    needed: bool
    factor: float
    tried: int
    gain: float = math.inf
    chance: float = math.nan
    at_end: bool = False
    lasts: float = math.inf

    @property
    def is_determined(self) -> bool:
        """Whether the record determines the equation at all."""
        return not math.isnan(self.factor)

    def reason(self) -> str:
        """Return the value and where it is from."""
        unit = f" {self.parameter.unit}" if self.parameter.unit else ""
        words = f"{self.parameter.full_name} {self.value:.4g} ± {self.error:.1g}{unit}"
        if not self.tried:
            return f"{words}: as given"
        low, high = self.limits
        return (
            f"{words}: best of {low:.4g} to {high:.4g}{unit} ({self.tried} identifications), and the errors of all other parameters "
            f"know that it is estimated; {self.judgement()}"
        )

    def judgement(self) -> str:
        """Return whether the term is needed."""
        term = self.parameter.term
        if self.needed:
            return f"with {term} the criterion is lower by {self.gain:.3g}, its inner parameters counted"
        how = f"higher by {-self.gain:.3g}" if self.gain <= 0 else f"lower by {self.gain:.3g} only"
        chance = (
            ""
            if math.isnan(self.chance)
            else f"; noise does as much somewhere in the range with probability {self.chance:.2g}"
        )
        return f"with {term} the criterion is {how}, its inner parameters counted{chance}"

    def advice(self) -> list[str]:
        """Return what to do."""
        term, name = self.parameter.term, self.parameter.full_name
        words: list[str] = []
        if not self.tried or not self.is_determined:
            return words
        if not self.needed:
            words.append(
                f"{term} is not needed: {self.judgement()}: leave it out; its error says that nothing is known of {name} but "
                "the range"
            )
        elif self.at_end:
            low, high = self.limits
            which = "highest" if abs(self.value - high) < abs(self.value - low) else "lowest"
            wider = (
                "velocities of the record hold no better one: the friction may be another one"
                if self.parameter.limits is None
                else f"search a wider range than {low:.4g} to {high:.4g}"
            )
            words.append(
                f"the best {name} is the {which} of its range, {self.value:.4g}: {wider}; its error means nothing there"
            )
        if self.needed and self.lasts < _FEWEST_SAMPLES:
            words.append(
                f"{term} fades within {self.lasts:.2g} samples of a turn, so {name} and its factor depend on how the velocity was "
                "smoothed, by more than their errors: record at a higher rate, or turn more slowly"
            )
        if self.needed and self.parameter.limits is None and self.factor < 0:
            words.append(
                f"{term} is negative: near rest the friction is smaller than beyond, not larger, as where it builds up over a distance "
                f"(presliding) or the velocity is smoothed; what {name} is then is not a Stribeck velocity"
            )
        return words


def words_of_search(found: Sequence[FoundBySearch]) -> Words:
    """Return what is to be said of the inner parameters of a record."""
    advice = tuple(dict.fromkeys(line for one in found for line in one.advice()))
    return Words(tuple(one.reason() for one in found if one.is_determined), advice)
