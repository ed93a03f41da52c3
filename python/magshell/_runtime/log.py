"""Progress messages for Python's `logging`, to the logger "magshell".

INFO: progress of searches, one line for each iteration, start or equilibrium found. DEBUG: every solve within
them, and every rejected design. Anything that a user must know is a warning or an error, never only a log message.
"""

from __future__ import annotations

import logging

log = logging.getLogger("magshell")
