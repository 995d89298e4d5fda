"""Names the flags of samples and of records: what they mean, what to do, how often they occur."""

from tvident._status.counts import describe
from tvident._status.flags import DOUBTFUL, DOUBTFUL_RECORD, RECORD_FLAGS, Status
from tvident._status.stretches import stretches_of, untold_samples

__all__ = ["DOUBTFUL", "DOUBTFUL_RECORD", "RECORD_FLAGS", "Status", "describe", "stretches_of", "untold_samples"]
