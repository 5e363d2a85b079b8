"""Noticing who is gone, and nothing else."""

import asyncio
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial

import pytest

from benchbot.supervisor.http.hang_ups import HangUps

Pair = Callable[[], tuple[socket.socket, socket.socket]]

PATIENCE_S = 60


def over_unix() -> tuple[socket.socket, socket.socket]:
    return socket.socketpair()


def over_tcp() -> tuple[socket.socket, socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        theirs = socket.create_connection(listener.getsockname())
        return listener.accept()[0], theirs


@asynccontextmanager
async def watching() -> AsyncIterator[HangUps]:
    hang_ups = HangUps()
    yield hang_ups
    hang_ups.close()


async def turns() -> None:
    """Let the event loop look at all that is there."""
    for _ in range(5):
        await asyncio.sleep(0)


@pytest.mark.parametrize("pair", [over_unix, over_tcp])
def test_who_is_gone_is_told_of_once_whatever_is_still_unread(pair: Pair) -> None:
    async def scenario() -> None:
        ours, theirs = pair()
        with ours, theirs:
            async with watching() as hang_ups:
                gone = asyncio.Event()
                told: list[int] = []

                def tell() -> None:
                    told.append(ours.fileno())
                    gone.set()

                hang_ups.watch(ours.fileno(), tell)
                theirs.sendall(b"a request")
                await turns()
                assert not told
                theirs.close()
                await asyncio.wait_for(gone.wait(), PATIENCE_S)
                await turns()
                assert told == [ours.fileno()]
                assert ours.recv(100) == b"a request"
                hang_ups.forget(ours.fileno())

    asyncio.run(scenario())


def test_who_is_gone_already_is_told_of_and_who_is_forgotten_is_not() -> None:
    async def scenario() -> None:
        pairs = [over_unix() for _ in range(3)]
        told: list[int] = []
        gone = asyncio.Event()

        def tell(number: int) -> None:
            told.append(number)
            gone.set()

        async with watching() as hang_ups:
            pairs[0][1].close()
            hang_ups.watch(pairs[0][0].fileno(), partial(tell, 0))
            await asyncio.wait_for(gone.wait(), PATIENCE_S)
            gone.clear()
            for number in (1, 2):
                hang_ups.watch(pairs[number][0].fileno(), partial(tell, number))
            for _ in range(2):
                hang_ups.forget(pairs[1][0].fileno())
            pairs[1][1].close()
            pairs[2][1].close()
            await asyncio.wait_for(gone.wait(), PATIENCE_S)
            await turns()
            assert told == [0, 2]
        for pair in pairs:
            for each in pair:
                each.close()

    asyncio.run(scenario())
