"""Carries out what the commands of the command line are asked for."""

from tvident._commands.compare import compare
from tvident._commands.demo import demo
from tvident._commands.derivatives import derivatives
from tvident._commands.identify import identify
from tvident._commands.info import info
from tvident._commands.live import live
from tvident._commands.plan import plan
from tvident._commands.report import report
from tvident._commands.settings import options_from_toml
from tvident._commands.simulate import simulate
from tvident._commands.words import in_options

__all__ = [
    "compare",
    "demo",
    "derivatives",
    "identify",
    "in_options",
    "info",
    "live",
    "options_from_toml",
    "plan",
    "report",
    "simulate",
]
