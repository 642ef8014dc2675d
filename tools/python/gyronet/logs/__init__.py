"""Import of logs: the formats are read by the libraries of those who keep them; here they become one drive."""

from gyronet.logs.drive import Drive
from gyronet.logs.opened import Request
from gyronet.refused import Refused

__all__ = ["Drive", "Refused", "Request"]
