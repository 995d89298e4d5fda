"""Clips residuals, so that spikes move an estimate by little, however large they are: Huber's loss."""

from tvident._huber.clipped import Clipped, clip_residuals, has_heavy_tails
from tvident._huber.modified_residuals import pseudo_values

__all__ = ["Clipped", "clip_residuals", "has_heavy_tails", "pseudo_values"]
