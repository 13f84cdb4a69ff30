"""Endpoints: where a session listens or connects, and what is wrong with one in a sentence.

Knows the text of an endpoint and the sockets of this machine; it opens no session.
"""

from __future__ import annotations

import re
import socket

from shearline.protocol.errors import LinkError

_ENDPOINT = re.compile(
    r"(tcp|tls|quic|udp|ws)/(?P<host>\[[0-9A-Fa-f:.%\w]+\]|[\w.-]+):(?P<port>\d{1,5})([?#]\S*)?",
    re.ASCII,
)


def free_endpoint(host: str = "127.0.0.1") -> str:
    """Return an endpoint that was free a moment ago."""
    with socket.socket() as probe:
        probe.bind((host, 0))
        return f"tcp/{host}:{probe.getsockname()[1]}"


def check_endpoint(endpoint: str) -> str:
    """Return an endpoint that is well-formed.

    Raises:
        LinkError: If it is not.
    """
    match = _ENDPOINT.fullmatch(endpoint)
    if match is None or not 0 <= int(match["port"]) < 2**16:
        raise LinkError(
            f"expected an endpoint such as tcp/192.168.1.5:7447, got {endpoint[:200]!r}: correct it"
        )
    return endpoint


def why_not_listening(endpoint: str, fault: str) -> str:
    """Say in a sentence what Zenoh's ``fault`` at listening means, and what to do."""
    for sign, why in (
        ("Address already in use", "it is taken: choose another port, or stop what listens there"),
        ("Cannot assign requested", "it is not an address of this machine: correct it"),
        ("Permission denied", "this user may not: choose a port above 1023"),
    ):
        if sign in fault:
            return f"cannot listen at {endpoint}: {why}"
    return f"cannot listen at {endpoint}: {plain(fault)}"


def why_nobody(endpoint: str, timeout_s: float) -> str:
    """Say in a sentence why a connection within ``timeout_s`` [s] may have failed."""
    match = _ENDPOINT.fullmatch(endpoint)
    try:
        socket.getaddrinfo(match and match["host"].strip("[]"), None)
    except OSError:
        return f"cannot find the host of {endpoint}: correct its name"
    return (
        f"nobody answers at {endpoint} within {timeout_s:g} s:"
        " start the learner there, or correct the endpoint"
    )


def plain(fault: str) -> str:
    """Cut what only Zenoh's authors need: paths of its sources."""
    return re.sub(r" at /\S+", "", fault)[:200]
