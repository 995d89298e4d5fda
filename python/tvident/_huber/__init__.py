"""Clips residuals, so that spikes move an estimate by little, however large they are: Huber's loss."""

from tvident._huber.modified_residuals import pseudo_values

__all__ = ["pseudo_values"]
