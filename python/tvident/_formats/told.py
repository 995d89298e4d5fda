"""What readers tell the process that asked for a file."""

from __future__ import annotations

import logging


class Sheet(str):
    """A table as text, which is read as any other text."""

    __slots__ = ()


class Remark(str):
    """What is not read as it stands in the file, among names of what is not read at all."""

    __slots__ = ()


def in_words(error: BaseException) -> str:
    """Return what went wrong."""
    return "too large" if isinstance(error, MemoryError) else cut(str(error) or type(error).__name__)


def cut(text: str) -> str:
    """Return text as long as a message may be."""
    return text[:200]


class Logged(logging.Handler):
    """Keeps what a library warns of: some say nowhere else what they did not read."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.messages: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a message."""
        self.messages.append(record.getMessage())
