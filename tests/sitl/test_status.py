"""The terminal line: what it says, and that nobody waits for a terminal that has stopped reading."""

import io
import os
import time

import pytest

from sitl.status import Report, Status, describe


def report(seconds: float, wall: float, **changes: object) -> Report:
    fields: dict[str, object] = {
        "time": seconds,
        "wall_time": wall,
        "state": "on the ground",
        "late_ticks": 0,
        "dropped_ticks": 0,
        "links": {"udpout:127.0.0.1:14550": {"rx": 3, "tx": 120, "dropped": 0, "malformed": 0}},
        "viewer_dropped": 0,
    }
    return Report(**(fields | changes))  # type: ignore[arg-type]


def test_the_line_gives_time_real_time_factor_late_ticks_links_and_state() -> None:
    line = describe(report(12.5, 105.0, late_ticks=2), before=report(10.0, 100.0))
    assert line == "t 12.5 s 0.50x late 2 | 14550 tx 120 rx 3 | on the ground"


def test_on_a_terminal_of_80_columns_the_line_has_everything_even_in_a_long_flight_with_many_links() -> None:
    links = {
        f"udpout:127.0.0.1:{port}": {"rx": 1_204_600, "tx": 3_100_000, "dropped": 0, "malformed": 0}
        for port in (14550, 14540, 14560)
    }
    moment = {"late_ticks": 1200, "links": links, "state": "100 m 20.0 m/s tilt 13 servos -"}
    line = describe(report(3601.4, 3700.0, **moment), report(3600.4, 3699.0), 79)
    assert line == "t 3601 s 1.00x late 1200 | tx 9.3M rx 3.6M | 100 m 20.0 m/s tilt 13 servos -"
    wide = describe(report(3601.4, 3700.0, **moment), report(3600.4, 3699.0), 159)
    assert "14550 tx 3.1M rx 1.2M, 14540 tx 3.1M rx 1.2M, 14560 tx" in wide


def test_where_even_that_is_too_long_the_state_is_cut_and_not_the_links() -> None:
    line = describe(report(1.0, 1.0, state="x" * 200), None, 79)
    assert len(line) == 79
    assert "tx 120 rx 3 | xxx" in line


@pytest.mark.parametrize(
    ("count", "text"),
    [(0, "0"), (999, "999"), (1000, "1.0k"), (9949, "9.9k"), (9950, "10k"), (999_499, "999k"), (999_500, "1.0M")],
)
def test_counts_keep_to_four_characters(count: int, text: str) -> None:
    links = {"tcpin:5760": {"rx": count, "tx": 0, "dropped": 0, "malformed": 0}}
    assert f"| 5760 tx 0 rx {text} |" in describe(report(1.0, 1.0, links=links), None)


def test_what_is_lost_is_shown_and_only_then() -> None:
    calm = describe(report(1.0, 1.0), before=None)
    assert "dropped" not in calm
    assert "malformed" not in calm
    links = {"tcpin:5760": {"rx": 3, "tx": 120, "dropped": 7, "malformed": 9}}
    rough = describe(report(1.0, 1.0, dropped_ticks=400, viewer_dropped=5, links=links), before=None)
    assert "dropped 400" in rough
    assert "dropped 7" in rough
    assert "malformed 9" in rough
    assert "viewer dropped 5" in rough


def test_lines_come_out_in_order_and_all_of_them_before_the_end() -> None:
    stream = io.StringIO()
    status = Status(stream)
    for number in range(100):
        status.say(f"line {number}")
    status.close()
    assert stream.getvalue().splitlines() == [f"line {number}" for number in range(100)]


def test_a_terminal_that_stands_still_holds_up_nobody() -> None:
    reader, writer = os.pipe()
    with open(reader, "rb"), open(writer, "w", encoding="utf-8") as nobody_reads:  # noqa: PTH123  (file descriptors)
        status = Status(nobody_reads)
        begin = time.monotonic()
        for number in range(2000):
            status.say("x" * 1000)  # far more than a pipe holds
            status.offer(report(float(number), float(number)))
        said = time.monotonic() - begin
        status.close(deadline=0.1)
        closed = time.monotonic() - begin - said
        os.set_blocking(reader, False)
        while status.is_writing():  # let the thread end, so that the files can be closed
            try:
                os.read(reader, 1 << 20)
            except BlockingIOError:
                time.sleep(0)
    assert said < 1.0
    assert closed == pytest.approx(0.1, abs=0.5)


def test_a_closed_terminal_is_no_error() -> None:
    stream = io.StringIO()
    status = Status(stream)
    stream.close()
    status.say("to nobody")
    status.close()
    assert not status.is_writing()
