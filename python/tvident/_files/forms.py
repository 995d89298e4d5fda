"""Text of every form: in columns, in lines of cells with names of their own, as oscilloscopes export it."""

from __future__ import annotations

import io
from pathlib import Path

from tvident._files import acqknowledge, motive, stamped_lines, vicon
from tvident._files.channels import Channels, Say
from tvident._files.named_cells import form_of, read_named_cells
from tvident._files.oscilloscopes import START, read_scope
from tvident._files.text import read_columns, read_start, read_text, read_whole


def read_any_text(path: Path, say: Say) -> Channels:
    """Read a text in the form that its first lines show."""
    start = read_start(path)
    if START.match(start):
        return read_scope(read_whole(path), read_columns, say)
    if acqknowledge.START.match(start):
        return acqknowledge.read_acqknowledge(read_whole(path), read_columns, say)
    for of_program in (stamped_lines, motive):
        if of_program.START.match(start):
            return read_columns(io.StringIO(of_program.plain_text(read_whole(path))), say)
    if vicon.START.match(start):
        return vicon.read_vicon(read_whole(path), read_columns, say)
    form = form_of(start)
    return read_text(path, say) if form is None else read_named_cells(read_whole(path), form, say)
