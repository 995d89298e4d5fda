"""Names the flags of samples and of records: what they mean, what to do, how often they occur."""

from tvident._status.counts import describe
from tvident._status.flags import DOUBTFUL, DOUBTFUL_RECORD, RECORD_FLAGS, Status

__all__ = ["DOUBTFUL", "DOUBTFUL_RECORD", "RECORD_FLAGS", "Status", "describe"]
