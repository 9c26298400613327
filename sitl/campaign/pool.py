"""Flies the cases of a campaign with several processes at once."""

import multiprocessing
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed

from sitl.campaign.fly import Campaign, Flyer
from sitl.campaign.outcome import Outcome

__all__ = ["fly_all"]

_flyer: Flyer  # of this process, where it is one of the pool's


def fly_all(campaign: Campaign, cases: int, jobs: int) -> Iterator[Outcome]:
    """Outcomes of cases 0 to `cases` - 1 as they come in, flown by so many processes.

    Each case is a flight of its own, so neither `jobs` nor the order changes any of them. With one job this process
    flies them itself, in order.
    """
    if jobs == 1:
        flyer = Flyer(campaign)
        for number in range(cases):
            yield flyer.fly(number).outcome
        return
    # Processes that start anew: a fork would copy threads' locks in whatever state they are.
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=spawn, initializer=_prepare, initargs=(campaign,)) as pool:
        flights = [pool.submit(_fly, number) for number in range(cases)]
        try:
            for flight in as_completed(flights):
                yield flight.result()
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _prepare(campaign: Campaign) -> None:
    global _flyer  # noqa: PLW0603
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that shows the progress
    _flyer = Flyer(campaign)


def _fly(number: int) -> Outcome:
    return _flyer.fly(number).outcome
