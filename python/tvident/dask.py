"""Identification and derivatives of dask arrays, on as many machines as dask has. Needs dask: install `tvident[dask]`."""

from tvident._dask import DaskIdentification, DaskPolynomialFit, fit_local_polynomials, identify

__all__ = ["DaskIdentification", "DaskPolynomialFit", "fit_local_polynomials", "identify"]
