import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "support", "python"))
from servers.daemon_fixtures import daemon, daemon_maker, shim  # noqa: E402, F401
from servers.small_disk import small_disk  # noqa: E402, F401
from disks.replay import memory_folder  # noqa: E402, F401
