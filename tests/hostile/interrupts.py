"""Ctrl-C at any time: calls end with KeyboardInterrupt soon, and the next call works as ever."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import tvident
from calls import paper

SOON = 1.0
"""Seconds: calls ask every 50 ms, and pieces take 20 ms; a busy machine takes the rest."""


def works(generator: np.random.Generator) -> list[Callable[[], Any]]:
    """Give long calls of every function."""
    n = 100_000
    t = np.arange(n) / 1000
    angle = 0.2 * np.sin(12 * t) + 0.1 * np.sin(44 * t) + 1e-4 * generator.standard_normal(n)
    torque = 15 * angle + 0.01 * np.gradient(np.gradient(angle, t), t) + 0.01 * generator.standard_normal(n)
    many = np.tile(angle, 8)
    drag = tvident.Term("drag", lambda _t, _angle, velocity: velocity * np.abs(velocity))
    columns = np.stack([angle] * 6, axis=1) + torque[:, np.newaxis] * np.arange(6)
    return [
        lambda: tvident.identify(angle, torque, sample_rate=1000),
        lambda: tvident.identify(angle, torque, sample_rate=1000, **paper(filter_torque=True)),
        lambda: tvident.identify(angle, torque, sample_rate=1000, terms=[drag], lag="auto"),
        lambda: tvident.identify(angle.reshape(5, -1), torque.reshape(5, -1), sample_rate=1000, workers=1),
        lambda: tvident.fit_local_polynomials(angle, "auto"),
        lambda: tvident.fit_local_polynomials(many, 201, selection="pooled").stderr,
        lambda: tvident.savgol_filter(many, 201, "aicc"),
        lambda: tvident.rolling_least_squares(columns, torque, 400),
        lambda: tvident.simulate_torsional_rig(duration=30.0),
    ]


def case(seed: int) -> None:
    """Interrupt a call after a random time, and see whether it works afterwards."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    generator = np.random.default_rng(seed)
    calls = works(generator)
    call = calls[seed % len(calls)]
    delay, sent = float(generator.uniform(0, 0.5)), [0.0]

    def interrupt() -> None:
        time.sleep(delay)
        sent[0] = time.monotonic()
        os.kill(os.getpid(), signal.SIGINT)

    sender = threading.Thread(target=interrupt)
    came = 0.0
    try:
        sender.start()
        call()
        sender.join()
    except KeyboardInterrupt:
        came = time.monotonic()
    sender.join()
    assert not came or came - sent[0] < SOON, f"heard after {came - sent[0]:.2f} s"
    y = np.sin(np.arange(1000) / 20)
    assert tvident.fit_local_polynomials(y, 51, workers=2).derivatives.shape == (3, 1000)
