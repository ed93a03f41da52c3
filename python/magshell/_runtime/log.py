"""What runs say of themselves through `logging`, to the logger "magshell", which a user's program may listen to.

INFO: what searches come to, a line an iteration, a start or an equilibrium found. DEBUG: every solve within them, and
every design that is rejected. What must be known is warned of and raised, never only logged.
"""

from __future__ import annotations

import logging

log = logging.getLogger("magshell")
