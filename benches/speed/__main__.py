"""Measure the rows, print the table, and store it on request."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from speed import environment, memory, table
from speed.corners import CORNERS
from speed.long import LONG
from speed.rows import ROWS, Row
from speed.streams import STREAMS
from speed.timing import Effort, alternate
from tvident import _core

_README = Path(__file__).parents[1] / "README.md"
_FULL = Effort(seconds=8.0, least=7)
_QUICK = Effort(seconds=1.0, least=3)
_QUICK_SHARE = 0.2
_ALL = [*ROWS, *CORNERS, *STREAMS, *LONG]


def main() -> int:
    """Run the command line."""
    arguments = _parser().parse_args()
    unknown = set(arguments.only) - {row.name for row in _ALL}
    if unknown:
        print(f"no row is called {', '.join(sorted(unknown))}; see --list", file=sys.stderr)
        return 2
    if arguments.store and (arguments.only or arguments.quick):
        print("only a whole table is stored; leave out --only and --quick", file=sys.stderr)
        return 2
    chosen = [row for row in _ALL if not arguments.only or row.name in arguments.only]
    if arguments.list:
        for row in chosen:
            print(f"{row.name:28}{row.work}")
        return 0
    kept = not arguments.fresh_pages and memory.keep_freed_memory()
    facts = [f"* {name}: {fact}" for name, fact in environment.describe(memory_kept=kept).items()]
    print("\n".join([*facts, "", *table.HEADER]), flush=True)
    lines = []
    for row in chosen:
        lines.append(_line(row, quick=arguments.quick))
        print(lines[-1], flush=True)
    if arguments.store:
        table.store(_README, [*facts, "", *table.HEADER, *lines])
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="speed", description=__doc__)
    parser.add_argument("--only", metavar="NAME", nargs="+", default=[], help="measure these rows alone")
    parser.add_argument("--quick", action="store_true", help="shorter records and fewer rounds: a rough look")
    parser.add_argument(
        "--fresh-pages", action="store_true", help="give freed memory back to the system after every call"
    )
    parser.add_argument("--store", action="store_true", help="write the table into benches/README.md")
    parser.add_argument("--list", action="store_true", help="list the rows and stop")
    return parser


def _line(row: Row, *, quick: bool) -> str:
    if row.instructions is not None and row.instructions not in _core.available_instructions():
        return table.missing(row)
    _core.force_instructions(row.instructions)
    try:
        duel = row.prepare(_QUICK_SHARE if quick else 1.0)
        try:
            duel.check()
            timings = alternate(duel.works, _QUICK if quick else _FULL, duel.calls)
        finally:
            duel.close()
    finally:
        _core.force_instructions(None)
    return table.Measured(row, timings, duel.samples).line()


if __name__ == "__main__":
    sys.exit(main())
