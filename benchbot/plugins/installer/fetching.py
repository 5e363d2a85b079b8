"""Fetching a file over HTTP, with the user name and password that its address may hold."""

import base64
import http.client
import urllib.error
import urllib.request
from urllib.parse import unquote, urlsplit

import benchbot
from benchbot.core.errors import BenchbotError
from benchbot.plugins.installer.indexes import public

TIMEOUT_S = 60.0
MOST_BYTES = 2**30


def fetch(url: str, accept: str) -> bytes:
    """Return what is at an http(s) address; raises BenchbotError, without its secrets, when it cannot be had."""
    parts = urlsplit(url)
    host = parts.netloc.rpartition("@")[2]
    headers = {"Accept": accept, "User-Agent": f"benchbot/{benchbot.__version__}"}
    if parts.username is not None:
        secret = f"{unquote(parts.username)}:{unquote(parts.password or '')}"
        headers["Authorization"] = f"Basic {base64.b64encode(secret.encode()).decode()}"
    if parts.scheme not in ("http", "https"):
        raise BenchbotError(f"{public(url)} cannot be fetched.", "It is no http or https address.", "Check it.")
    request = urllib.request.Request(parts._replace(netloc=host).geturl(), headers=headers)  # noqa: S310
    try:
        with urllib.request.urlopen(request, timeout=TIMEOUT_S) as response:  # noqa: S310
            content = response.read(MOST_BYTES + 1)
    except (OSError, http.client.HTTPException, ValueError) as error:
        reason = f"{error.code} {error.reason}" if isinstance(error, urllib.error.HTTPError) else error
        raise BenchbotError(
            f"{public(url)} cannot be fetched.", f"{public(str(reason))}.", "Check the address and the network."
        ) from error
    if len(content) > MOST_BYTES:
        raise BenchbotError(
            f"{public(url)} is too large.", "It is over 1 GiB.", "Fetch it yourself, and name the file."
        )
    return bytes(content)
