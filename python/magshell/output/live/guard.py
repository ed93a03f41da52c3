"""Guards the server of a live view: only pages that it served itself, by their secret address, may read and drive it.

A browser lets a page of any site open WebSockets to this machine. So the server checks the Host and the Origin of
requests, and the page's address contains a random token, as Jupyter's does.
"""

from __future__ import annotations

import http
import ipaddress
import secrets
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

_LOCAL = ("localhost", "127.0.0.1", "::1")
_serving = threading.Lock()  # only one server at a time is started with a guard


class Guard:
    """Decides which requests a server answers.

    host: the address that it serves at. token: the secret part of the page's address.
    """

    def __init__(self, host: str):
        self.token: str = secrets.token_hex(16)
        self._hosts = (*_LOCAL, host.lower()) if _is_local(host) else None

    def refusal(self, path: str, headers: list[tuple[str, str]]) -> str:
        """Return why a request is refused, "" if it is not. headers: (name, value) of each."""
        given: dict[str, list[str]] = {}
        for name, value in headers:
            given.setdefault(name.lower(), []).append(value.strip().lower())
        hosts, origins = given.get("host", []), given.get("origin", [])
        if len(hosts) != 1 or len(origins) > 1:
            return "a request needs one Host and at most one Origin"
        if self._hosts is not None and _name_of(f"//{hosts[0]}") not in self._hosts:
            return "this view serves its own machine under its own name"
        if origins and urlsplit(origins[0]).netloc != hosts[0]:
            return "a page of another origin has no access to this view"
        asks_for_data = "upgrade" in given or path.partition("?")[0] in ("", "/", "/index.html")
        return "the address lacks the token of this view" if asks_for_data and not self._knows(path) else ""

    def without_token(self, path: str) -> str:
        """Return the path of a request as the server knows it."""
        return path[len(self.token) + 1 :] or "/" if self._knows(path) else path

    def _knows(self, path: str) -> bool:
        first = path.partition("?")[0].split("/")[1:2]
        return bool(first) and secrets.compare_digest(first[0].encode(), self.token.encode())


def _is_local(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == "localhost"


def _name_of(address: str) -> str:
    """Return the name of the machine in an address, without the port."""
    try:
        return urlsplit(address).hostname or ""
    except ValueError:
        return ""


@contextmanager
def guarded(guard: Guard) -> Iterator[None]:
    """Put a guard before the server of viser that is started inside the block.

    viser takes no check of requests, so it is put into its call of websockets. Raises RuntimeError if viser made none, as
    another version may.
    """
    import websockets.asyncio.server as servers

    serve, used = servers.serve, []

    def guarding(handler: Any, *arguments: Any, process_request: Any = None, **options: Any) -> Any:
        if getattr(handler, "__module__", "").split(".")[0] != "viser":  # a server of another thread
            return serve(handler, *arguments, process_request=process_request, **options)
        used.append(True)
        return serve(handler, *arguments, process_request=_checking(guard, process_request), **options)

    with _serving:
        servers.serve = guarding
        try:
            yield
        finally:
            servers.serve = serve
    if not used:
        raise RuntimeError(
            "this version of viser starts its server in a way that magshell cannot guard against other pages: install "
            "viser 1.1"
        )


def _checking(guard: Guard, answer: Callable[[Any, Any], Any] | None) -> Callable[[Any, Any], Any]:
    def check(connection: Any, request: Any) -> Any:
        if why := guard.refusal(request.path, list(request.headers.raw_items())):
            return connection.respond(http.HTTPStatus.FORBIDDEN, f"{why}\n")
        request.path = guard.without_token(request.path)
        return None if answer is None else answer(connection, request)

    return check
