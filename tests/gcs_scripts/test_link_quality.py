"""Losses and rates of a link, against streams of which they are known."""

import itertools
import random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mav

from gcs_scripts.link_quality import LinkQuality, SequenceCounter


def counted(numbers: list[int]) -> tuple[int, int]:
    counter = SequenceCounter()
    for number in numbers:
        counter.add(number % 256)
    return counter.received, counter.lost


@given(st.integers(0, 255), st.lists(st.booleans(), min_size=2, max_size=2000))
def test_what_is_left_out_between_the_first_and_the_last_is_lost(begin: int, kept: list[bool]) -> None:
    numbers = [begin + i for i, keep in enumerate(kept) if keep]
    gaps = [b - a for a, b in itertools.pairwise(numbers)]
    if numbers and max(gaps, default=1) < 128:
        assert counted(numbers) == (len(numbers), numbers[-1] - numbers[0] + 1 - len(numbers))


def test_reordered_and_doubled_messages_are_no_losses() -> None:
    numbers = list(range(1000))
    for i in range(0, 990, 10):
        numbers[i + 3], numbers[i + 6] = numbers[i + 6], numbers[i + 3]
    doubled = [n for n in numbers for _ in range(1 + n % 2)]
    assert counted(doubled) == (1000, 0)


def frame(sender: Any) -> bytearray:
    """The next message of a sender."""
    message = mav.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 1)
    data = bytearray(message.pack(sender))
    sender.seq = (sender.seq + 1) % 256
    return data


def test_losses_are_told_by_system_and_rates_in_total() -> None:
    chance = random.Random(3)
    ours, other, companion = mav.MAVLink(None, 1, 1), mav.MAVLink(None, 7, 1), mav.MAVLink(None, 1, 191)
    decoder = mav.MAVLink(None)
    quality = LinkQuality(0.0)
    dropped = {1: 0, 7: 0}
    size = 0
    for step in range(400):  # 4 s of 100 Hz
        for sender, share in ((ours, 0.2), (other, 0.0), (companion, 0.0)):
            data = frame(sender)
            if 0 < step < 399 and chance.random() < share:
                dropped[sender.srcSystem] += 1
                continue
            size += len(data)
            quality.add(decoder.decode(data))
        quality.update(0.01 * step)
    assert quality.loss() == {1: pytest.approx(dropped[1] / 800), 7: 0.0}
    messages, rate = quality.rates(4.0)
    assert messages == pytest.approx((1200 - dropped[1]) / 4.0)
    assert rate == pytest.approx(size / 4.0)


def test_losses_of_long_ago_are_forgotten() -> None:
    quality = LinkQuality(0.0)
    sender, decoder = mav.MAVLink(None, 1, 1), mav.MAVLink(None)
    for step in range(3000):  # 30 s of 100 Hz, half of the first second lost
        data = frame(sender)
        if step >= 100 or step % 2 == 0:
            quality.add(decoder.decode(data))
        quality.update(0.01 * step)
        if step == 150:
            assert quality.loss()[1] > 0.3
    assert quality.loss() == {1: 0.0}


def test_messages_that_pymavlink_does_not_know_are_no_losses() -> None:
    sender, decoder, quality = mav.MAVLink(None, 1, 1), mav.MAVLink(None), LinkQuality(0.0)
    for step in range(50):
        data = frame(sender)
        if step % 2:
            data[7:10] = (61_111).to_bytes(3, "little")  # an id that nobody has
        quality.add(decoder.decode(data))
    assert quality.loss() == {1: 0.0}
