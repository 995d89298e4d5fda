"""Attacks on the library: random calls, hostile numbers and files, threads, forks and interrupts, each case from one seed."""
