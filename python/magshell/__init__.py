"""magshell: thin shells of hard-magnetic soft material, their equilibria and motions."""

from ._config import num_threads, set_num_threads, show_config
from ._core import __version__

__all__ = ["__version__", "num_threads", "set_num_threads", "show_config"]
