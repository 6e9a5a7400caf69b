import asyncio
import threading

import pytest

pytest.importorskip("starlette", reason="the app needs softvox-gym[explore]")

from softvox_view.explore.jobs import BusyError, Jobs

PATIENCE = 10  # s; all of this takes milliseconds


def run(scenario, **options):
    async def whole():
        jobs = Jobs(**options)
        try:
            return await asyncio.wait_for(scenario(jobs), PATIENCE)
        finally:
            jobs.join()

    return asyncio.run(whole())


async def all_of(job):
    return [event async for event in job.events()]


def names(events):
    return [event["event"] for event in events]


class Endless:
    """Work that goes on until it is cancelled."""

    def __init__(self):
        self.begun, self.ended = threading.Event(), threading.Event()

    def __call__(self, job):
        self.begun.set()
        try:
            while True:
                job.report(1, 2)
                self.ended.wait(0.001)
        finally:
            self.ended.set()


def at_once(job):
    return {"answer": 42}


async def begun(work):
    await asyncio.to_thread(work.begun.wait, PATIENCE)


def test_the_last_event_has_what_the_work_returned():
    async def scenario(jobs):
        return await all_of(jobs.start("tab", at_once))

    assert run(scenario)[-1] == {"event": "done", "answer": 42}


def test_the_newest_request_of_a_tab_wins_and_the_older_one_ends():
    async def scenario(jobs):
        slow = Endless()
        older = asyncio.create_task(all_of(jobs.start("tab", slow)))
        await begun(slow)
        newer = await all_of(jobs.start("tab", at_once))
        return slow.ended.is_set(), names(await older)[-1], names(newer)[-1], jobs.running

    assert run(scenario) == (True, "superseded", "done", 0)


def test_requests_do_not_pile_up_those_in_between_never_begin():
    async def scenario(jobs):
        slow, between = Endless(), [Endless() for _ in range(20)]
        tasks = [asyncio.create_task(all_of(jobs.start("tab", slow)))]
        await begun(slow)
        tasks += [asyncio.create_task(all_of(jobs.start("tab", work))) for work in between]
        await asyncio.sleep(0)
        last = await all_of(jobs.start("tab", at_once))
        ends = [names(events)[-1] for events in await asyncio.gather(*tasks)]
        return names(last)[-1], set(ends), any(work.begun.is_set() for work in between)

    assert run(scenario) == ("done", {"superseded"}, False)


def test_a_slow_tab_does_not_block_another():
    async def scenario(jobs):
        slow = Endless()
        older = asyncio.create_task(all_of(jobs.start("slow", slow)))
        await begun(slow)
        events = await all_of(jobs.start("other", at_once))
        still_runs = not slow.ended.is_set()
        jobs.close()
        await older
        return names(events)[-1], still_runs

    assert run(scenario) == ("done", True)


def test_progress_is_told():
    async def scenario(jobs):
        slow = Endless()
        job = jobs.start("tab", slow)
        seen = []
        async for event in job.events():
            seen.append(event)
            job.cancel()
        return seen

    assert run(scenario) == [
        {"event": "progress", "done": 1, "total": 2},
        {"event": "superseded"},
    ]


def test_one_tab_too_many_is_refused_but_a_tab_that_runs_may_ask_anew():
    async def scenario(jobs):
        slow = Endless()
        older = asyncio.create_task(all_of(jobs.start("slow", slow)))
        await begun(slow)
        with pytest.raises(BusyError, match="1 computations are running already"):
            jobs.start("other", at_once)
        events = await all_of(jobs.start("slow", at_once))
        await older
        return names(events)[-1]

    assert run(scenario, most=1) == "done"


def test_work_that_fails_says_so_and_leaves_the_tab_free():
    def failing(job):
        raise ValueError("no such luck")

    async def scenario(jobs):
        first = await all_of(jobs.start("tab", failing))
        second = await all_of(jobs.start("tab", at_once))
        return first[-1], names(second)[-1]

    assert run(scenario) == ({"event": "error", "error": "no such luck"}, "done")


def test_work_that_nobody_listens_to_ends_all_the_same():
    async def scenario(jobs):
        jobs.start("tab", at_once)
        while jobs.running:
            await asyncio.sleep(0.001)
        return names(await all_of(jobs.start("tab", at_once)))[-1]

    assert run(scenario) == "done"


def test_what_is_to_happen_on_cancelling_happens_at_once_and_once():
    async def scenario(jobs):
        heard = []
        job = jobs.start("tab", at_once)
        job.when_cancelled(lambda: heard.append("before"))
        job.cancel()
        job.cancel()
        job.when_cancelled(lambda: heard.append("after"))
        return names(await all_of(job)), heard

    assert run(scenario) == (["superseded"], ["before", "after"])
