"""A router that stands between a learner and its evaluators, as a site's own would.

Run as ``python hub.py ENDPOINT``; goes on until it is ended.
"""

from __future__ import annotations

import sys
import threading

from shearline.deploy.processes import die_with_parent
from shearline.protocol.link import open_router

if __name__ == "__main__":
    die_with_parent()
    with open_router(sys.argv[1]):
        threading.Event().wait()
