"""Requests take turns."""

import asyncio

from api.turnstile import AT_ONCE, MOST_ABANDONED, Turnstile


def test_requests_begin_a_few_in_a_turn_and_stops_first():
    begun: list[str] = []

    async def crowd() -> None:
        turnstile = Turnstile(asyncio.get_running_loop())
        for number in range(3 * AT_ONCE):
            turnstile.wait(lambda number=number: begun.append(f"{number}"), is_stop=False)
        turnstile.wait(lambda: begun.append("stop"), is_stop=True)
        for _ in range(2):
            await asyncio.sleep(0)
        assert len(begun) == AT_ONCE
        assert begun[0] == "stop"
        while len(begun) < 3 * AT_ONCE + 1:
            await asyncio.sleep(0)

    asyncio.run(crowd())
    assert begun[1:] == [f"{number}" for number in range(3 * AT_ONCE)]


def test_requests_that_go_on_for_nobody_keep_the_next_ones_waiting_until_they_end():
    begun: list[str] = []

    async def crowd() -> None:
        turnstile = Turnstile(asyncio.get_running_loop())
        for _ in range(MOST_ABANDONED):
            turnstile.abandon()

        def gone() -> None:
            begun.append("gone")

        turnstile.wait(gone, is_stop=False)
        turnstile.wait(lambda: begun.append("next"), is_stop=False)
        turnstile.leave(gone)
        for _ in range(5):
            await asyncio.sleep(0)
        assert begun == []
        turnstile.wait(lambda: begun.append("stop"), is_stop=True)
        for _ in range(3):
            await asyncio.sleep(0)
        assert begun == ["stop"]
        turnstile.end_abandoned()
        for _ in range(3):
            await asyncio.sleep(0)
        assert begun == ["stop", "next"]

    asyncio.run(crowd())
