"""Identifies and differentiates dask arrays: block by block, on as many machines as dask has."""

from tvident._dask.found import DaskIdentification
from tvident._dask.identification import identify
from tvident._dask.polynomials import DaskPolynomialFit, fit_local_polynomials

__all__ = ["DaskIdentification", "DaskPolynomialFit", "fit_local_polynomials", "identify"]
