"""What readers tell the process that asked for a file."""

from __future__ import annotations


class Sheet(str):
    """A table as text, which is read as any other text."""

    __slots__ = ()


def in_words(error: BaseException) -> str:
    """Return what went wrong."""
    return "too large" if isinstance(error, MemoryError) else cut(str(error) or type(error).__name__)


def cut(text: str) -> str:
    """Return text as long as a message may be."""
    return text[:200]
