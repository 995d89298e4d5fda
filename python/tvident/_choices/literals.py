"""Words that settings take, by what they are settings of."""

from __future__ import annotations

from typing import Literal, TypeAlias

Kind: TypeAlias = Literal["windowed", "constant", "auto", "varying"]

Criterion: TypeAlias = Literal["aicc", "aicc-textbook", "aic", "bic"]

Selection: TypeAlias = Literal["window", "pooled", "average"]

Variation: TypeAlias = Literal["constant", "linear"]

Loss: TypeAlias = Literal["squares", "huber"]

NanPolicy: TypeAlias = Literal["propagate", "raise"]

RowPolicy: TypeAlias = Literal["omit", "propagate", "raise"]
"""What to do about values that are no number, where windows may do without some of their rows."""

Pattern: TypeAlias = Literal["slider", "ramp", "square", "constant"]

Excitation: TypeAlias = Literal["multisine", "chirp", "random"]
