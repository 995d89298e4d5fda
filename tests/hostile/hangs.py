"""Calls of sizes that nobody can mean or no machine can hold end at once, or obey Ctrl-C."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import numpy as np

_PREPARED = """
import resource, signal
import numpy as np, tvident
resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30))
signal.signal(signal.SIGINT, signal.default_int_handler)
x = np.sin(np.arange(2000) / 50)
print("ready", flush=True)
"""
"""What stands before a call: little memory, and Ctrl-C, which a shell's background jobs are born ignoring."""

_PATIENCE = 5.0
"""Seconds until Ctrl-C."""

_OBEYED = 4.0
"""Seconds within which Ctrl-C ends a process on a machine that does other work; the calls themselves hear it within 0.1 s."""

_HUGE = ("10**5", "10**8", "2**31", "2**40 + 1", "2**53", "2**62", "2**63 - 1")
_EXTREME = ("1e-300", "1e-12", "1e-3", "1e3", "1e12", "1e18", "1e300")

_EXPECTED = {"", "ValueError", "MemoryError", "_ArrayMemoryError", "KeyboardInterrupt"}
"""What the last line of standard error may begin with."""

CALLS = (
    "tvident.fit_local_polynomials(x, 101, max_deriv={huge})",
    "tvident.fit_local_polynomials(x, 'auto', max_deriv={huge})",
    "tvident.fit_local_polynomials(x, {huge} // 2 * 2 + 1)",
    "tvident.fit_local_polynomials(x, 101, step={huge}, workers={huge})",
    "tvident.savgol_filter(x, 101, 3, deriv={huge})",
    "tvident.savgol_filter(x, {huge}, 1, mode='wrap')",
    "tvident.savgol_filter(x[:3], {huge}, 1, mode='mirror')",
    "tvident.savgol_filter(x[:1], 100_001, 1, mode='nearest')",
    "tvident.rolling_least_squares(x, x, {huge})",
    "tvident.RollingStream({huge}).push(x, x)",
    "tvident.LocalPolynomialStream({huge} // 2 * 2 + 1, sample_rate=100).push(x)",
    "tvident.IdentificationStream(sample_rate=100, method='paper', settings={{'regression_window': {huge}}}).push(x, x)",
    "tvident.identify(x, x, sample_rate=1000, step={huge}, method=tvident.WeakForm(window_length={huge} // 2 * 2 + 1))",
    "tvident.identify(x, x, sample_rate={extreme}, lag={extreme})",
    "tvident.simulate_torsional_rig(duration=.1, inertia={extreme})",
    "tvident.simulate_torsional_rig(duration=.1, torsional_rigidity={extreme})",
    "tvident.simulate_torsional_rig(duration=.1, damping={extreme})",
    "tvident.simulate_torsional_rig(duration={extreme})",
    "tvident.simulate_torsional_rig(duration=200, sample_rate={extreme})",
)


def case(seed: int) -> None:
    """Make one call in a process of its own, and interrupt it where it takes long."""
    generator = np.random.default_rng(seed)
    huge, extreme = (str(generator.choice(values)) for values in (_HUGE, _EXTREME))
    call = CALLS[seed % len(CALLS)].format(huge=huge, extreme=extreme)
    process = subprocess.Popen(
        [sys.executable, "-c", f"{_PREPARED}{call}"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    began = time.monotonic()
    try:
        _, said = process.communicate(timeout=_PATIENCE)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGINT)
        began = time.monotonic()
        try:
            _, said = process.communicate(timeout=_OBEYED)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            raise AssertionError(f"{call} hears no Ctrl-C") from None
    took = time.monotonic() - began
    assert process.returncode in {0, 1, -signal.SIGINT}, f"{call} ended with {process.returncode}: {said[-1000:]}"
    last = said.strip().splitlines()[-1] if said.strip() else ""
    error = last.split(":")[0].rpartition(".")[2]
    assert error in _EXPECTED, f"{call}: {last} after {took:.1f} s"
