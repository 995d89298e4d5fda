"""Takes recordings piece by piece and gives the batch's numbers with a fixed delay, in constant memory."""

from tvident._stream.derivatives import LocalPolynomialStream
from tvident._stream.identification import IdentificationStream
from tvident._stream.regression import RollingStream
from tvident._stream.streamed import StreamedIdentification

__all__ = ["IdentificationStream", "LocalPolynomialStream", "RollingStream", "StreamedIdentification"]
